"""The distance to apply: the largest of the computed, official and prescribed ones, by what is done with the rounds.

A computed distance is no leave to stay below a prescribed one, nor a prescribed one leave to stay below a larger
computed one. A rule that is meant for such rounds and has no distance here, and a computed distance that is not
determined, leave the distance incomplete, and both are named. Terminal, summary.json, report, map, application and
Python all show this one object.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from fragfield.case import CaseTable
from fragfield.case.conversion.rounds import are_alike
from fragfield.hazard.contents import DISPOSAL, SITING, with_images
from fragfield.results.hazard import Hazard
from fragfield.results.rules import DistanceOfUse, DistanceToApply, LeftOut, Official, Rule
from fragfield.results.words import NOT_DETERMINED, metres, whole_metres

_Uses = Sequence[tuple[DistanceOfUse, str]]


USES = {SITING: "storage and handling", DISPOSAL: "disposal in the open"}
"""Activities for which distances are prescribed, in words."""
_COMPUTED = "recommended distance of this computation"


def distance_to_apply(hazard: Hazard | None, official: Official | None, rules: Sequence[Rule]) -> DistanceToApply:
    """The distances to apply, in one line and in sentences; `hazard` is None before anything is computed."""
    siting, disposal = (_of_use(use, hazard, official, rules) for use in USES)
    computed = None if hazard is None else hazard.recommended
    uses = ((siting, USES[SITING]), (disposal, USES[DISPOSAL]))
    against = tuple(_official_words(hazard, official))
    return DistanceToApply(
        line=f"Distance to apply: {', '.join(_distance(one, title) for one, title in uses)}",
        computed=computed, siting=siting, disposal=disposal, official=against,
        words=(
            *(f"{title[0].upper()}{title[1:]}: {metres(one.distance)}, by {one.by}." for one, title in uses if one.by),
            *_left_out(uses),
            *against,
        ),
    )  # fmt: skip


def _distance(one: DistanceOfUse, title: str) -> str:
    if one.incomplete and one.distance is not None:
        return f"at least {metres(one.distance)} ({title}, incomplete)"
    return f"{'not known' if one.distance is None else metres(one.distance)} ({title})"


def _left_out(uses: _Uses) -> Iterator[str]:
    reasons: dict[tuple[bool, str], tuple[dict[str, None], dict[str, LeftOut]]] = {}
    for use, title in uses:
        for one in use.left_out:
            titles, named = reasons.setdefault((one.missing, one.reason), ({}, {}))
            titles[title], named[one.name] = None, one
    for (missing, reason), (titles, named) in sorted(reasons.items(), key=lambda item: not item[0][0]):
        shown = [
            f"“{one.name}”{'' if one.distance is None else f' ({metres(one.distance)} by its formula)'}"
            for one in named.values()
        ]
        known = [one.distance for one in named.values() if one.distance is not None]
        what = f"{' and '.join(titles)}: left out {', '.join(shown)}, because {reason}."
        if not missing:
            yield f"Not applied for {what}"
        elif known:
            yield f"Incomplete for {what} Apply {metres(max(known))} unless the authority agrees to less."
        else:
            yield f"Incomplete for {what} The authority must say what holds instead."


def _of_use(use: str, hazard: Hazard | None, official: Official | None, rules: Sequence[Rule]) -> DistanceOfUse:
    """The largest distance of a use, and larger or unknown ones that are left out; of equal ones the first decides."""
    prescribed = [rule for rule in rules if rule.use == use]
    candidates: list[tuple[float, str]] = []  # m, and by what
    left_out = []
    if hazard is not None and hazard.recommended is not None:
        candidates.append((hazard.recommended, f"the {_COMPUTED}"))
    elif hazard is not None:
        reason = f"it is {NOT_DETERMINED}: {hazard.reason}"
        left_out.append(LeftOut(name=_COMPUTED, reason=reason, distance=None, missing=True))
    if official is not None and official.hazardous_fragment_distance is not None:
        words = "the official hazardous fragment distance"
        candidates.append((official.hazardous_fragment_distance, words))
    if use == DISPOSAL and official is not None and official.maximum_fragment_distance is not None:
        candidates.append((official.maximum_fragment_distance, "the official maximum fragment distance"))
    candidates += [
        (rule.distance, f"the rule “{rule.name}” ({rule.hazard})") for rule in prescribed if rule.distance is not None
    ]
    largest = max(candidates, key=lambda one: one[0], default=None)
    left_out += [
        LeftOut(name=rule.name, reason=rule.reason, distance=rule.outside, missing=rule.missing)
        for rule in prescribed
        if rule.distance is None
        and (rule.missing if rule.outside is None else largest is None or rule.outside > largest[0])
    ]
    return DistanceOfUse(distance=largest and largest[0], by=largest and largest[1], left_out=tuple(left_out))


def official_part(case: CaseTable) -> Official | None:
    """The table of a resolved case and how many rounds stand there; None without.

    `covers` is whether the distances are published for as many rounds as stand there with their images, all `alike`;
    None where the fragments come from another source and no rounds are known.
    """
    if case.official is None:
        return None
    here = len(with_images(case)) if case.round else None
    alike = are_alike(case) if case.round else None
    covers = None if here is None else here <= case.official.rounds and bool(alike)
    return Official(**case.official.model_dump(), rounds_here=here, alike=alike, covers=covers)


def _official_words(hazard: Hazard | None, official: Official | None) -> Iterator[str]:
    if official is None:
        yield "No official distance of the round is in the case (table [official])."
        return
    if hazard is not None and official.hazardous_fragment_distance is not None:
        yield _against_hazardous(official.hazardous_fragment_distance, hazard)
    if hazard is not None and official.maximum_fragment_distance is not None:
        throw = hazard.largest_throw if hazard.determined else None
        yield _against_maximum(official.maximum_fragment_distance, throw)
    if note := official_note(official):
        yield note


def _against_hazardous(official: float, hazard: Hazard) -> str:
    short, computed = hazard.without_ricochet, hazard.recommended
    beside = "" if hazard.ricochet == "none" else f" (without ricochet {metres(short.recommended)})"
    theirs, ours = f"{whole_metres(official)} m", f"{whole_metres(computed)} m{beside}"
    name = "official hazardous fragment distance"
    if computed is None:
        return f"The {name} is {theirs}; the recommended distance is not determined and may be larger."
    if whole_metres(official) == whole_metres(computed):
        return f"The {name}, {theirs}, equals the recommended distance, {ours}."
    if official > computed:
        return f"The {name}, {theirs}, is larger than the recommended distance, {ours}: the official one governs."
    return f"The recommended distance, {ours}, is larger than the {name}, {theirs}: the recommended one governs."


def _against_maximum(official: float, throw: float | None) -> str:
    theirs, ours = f"{whole_metres(official)} m", f"{whole_metres(throw)} m"
    name = "official maximum fragment distance"
    if throw is None:
        return f"The {name} is {theirs}; the throw exceeded in 5 % of events is not determined."
    if throw > official:
        return (
            f"The throw exceeded in 5 % of events, computed as {ours}, is larger than the {name}, {theirs}: fragments "
            "may land beyond it."
        )
    return f"The {name}, {theirs}, is not less than the computed throw exceeded in 5 % of events, {ours}."


def official_note(official: Official) -> str:
    """That the official distance is for fewer rounds than stand there, or that this is not known; empty otherwise."""
    number = official.rounds
    published = f"published for {'one round' if number == 1 else f'{number} rounds'}"
    if official.covers is None:
        return f"The official distances are {published}; how many rounds the fragments come from is not known here."
    if official.covers:
        return ""
    if official.alike is False:
        return f"The official distances are {published}; rounds of different kinds stand here, which they do not cover."
    return f"The official distances are {published}; {official.rounds_here} stand here, which they do not cover."
