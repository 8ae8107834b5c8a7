"""The distance to apply: the largest of the computed, official and prescribed ones, by what is done with the rounds.

A computed distance is no leave to stay below a prescribed one, nor a prescribed one leave to stay below a larger
computed one. A rule that is meant for such rounds and has no distance here, and a computed distance that is not
determined, leave the distance incomplete, and both are named. Terminal, summary.json, report, map, application and
Python all show this one object.
"""

from __future__ import annotations

from dataclasses import asdict, dataclass
from typing import TYPE_CHECKING, Any, NamedTuple

from fragfield.case.conversion.rounds import are_alike
from fragfield.hazard.certainty import NOT_DETERMINED, metres, whole_metres
from fragfield.hazard.contents import DISPOSAL, SITING, with_images

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fragfield.case import CaseTable


USES = {SITING: "storage and handling", DISPOSAL: "disposal in the open"}
"""Activities for which distances are prescribed, in words."""
_HAZARDOUS, _MAXIMUM = "hazardous_fragment_distance", "maximum_fragment_distance"
_COMPUTED = "recommended distance of this computation"


@dataclass(frozen=True)
class LeftOut:
    """A distance that is not among those of which the largest is applied."""

    name: str
    """Of the rule."""
    reason: str
    """Why."""
    distance: float | None
    """What its formula gives all the same (m); None where it gives nothing."""
    missing: bool
    """Whether it is meant for such rounds and nothing takes its place."""


@dataclass(frozen=True)
class DistanceOfUse:
    """The distance to apply for an activity."""

    distance: float | None
    """In m; None where nothing is known."""
    by: str | None
    """What it is by."""
    left_out: tuple[LeftOut, ...] = ()
    """Distances left out that are larger or not known."""

    @property
    def incomplete(self) -> bool:
        """Whether a distance is missing that may be larger."""
        return any(one.missing for one in self.left_out)


@dataclass(frozen=True)
class DistanceToApply:
    """The distances to apply, the computed one, and what was left out."""

    computed: float | None
    """The recommended distance of the computation (m); None where it is not determined."""
    siting: DistanceOfUse
    """For storage and handling."""
    disposal: DistanceOfUse
    """For disposal in the open."""
    official: tuple[str, ...] = ()
    """Sentences on the official distances against the computed ones."""

    @classmethod
    def of(
        cls,
        hazard: Mapping[str, Any] | None,
        official: Mapping[str, Any] | None,
        rules: Sequence[Mapping[str, Any]],
    ) -> DistanceToApply:
        """From the parts `hazard` (None before anything is computed), `official` and `rules.rules` of summary.json."""
        uses = {use: _of_use(use, hazard, official or {}, rules) for use in USES}
        computed = None if hazard is None else hazard.get("recommended")
        return cls(computed, uses[SITING], uses[DISPOSAL], tuple(_official_words(hazard or {}, computed, official)))

    @classmethod
    def read(cls, part: Mapping[str, Any]) -> DistanceToApply:
        """From the part `distance_to_apply` of summary.json."""
        siting, disposal = (
            DistanceOfUse(one["distance"], one["by"], tuple(LeftOut(**left) for left in one["left_out"]))
            for one in (part[SITING], part[DISPOSAL])
        )
        return cls(part["computed"], siting, disposal, tuple(part["official"]))

    def as_dict(self) -> dict[str, Any]:
        """The part `distance_to_apply` of summary.json."""
        return {"line": self.line, "words": list(self.words), **asdict(self)}

    @property
    def line(self) -> str:
        """The distances in one line."""
        return f"Distance to apply: {self.distances}"

    @property
    def distances(self) -> str:
        """The distances with their activities."""
        return ", ".join(
            f"at least {metres(one.distance)} ({title}, incomplete)" if one.incomplete and one.distance is not None
            else f"{'not known' if one.distance is None else metres(one.distance)} ({title})"
            for one, title in self._uses
        )  # fmt: skip

    @property
    def words(self) -> tuple[str, ...]:
        """Sentences: what each distance is by, what was left out and why, and the official distances."""
        return (*self._by(), *self._left_out(), *self.official)

    @property
    def _uses(self) -> tuple[tuple[DistanceOfUse, str], ...]:
        return (self.siting, USES[SITING]), (self.disposal, USES[DISPOSAL])

    def _by(self) -> Iterator[str]:
        for one, title in self._uses:
            if one.distance is not None:
                yield f"{title[0].upper()}{title[1:]}: {metres(one.distance)}, by {one.by}."

    def _left_out(self) -> Iterator[str]:
        """What was left out, by reason: distances that are missing first."""
        reasons: dict[tuple[bool, str], tuple[dict[str, None], dict[str, LeftOut]]] = {}
        for use, title in self._uses:
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


class _Candidate(NamedTuple):
    """A distance (m) that may be the largest, and by what."""

    distance: float
    by: str


def _of_use(
    use: str, hazard: Mapping[str, Any] | None, official: Mapping[str, Any], rules: Sequence[Mapping[str, Any]]
) -> DistanceOfUse:
    """The largest distance of a use, and larger or unknown ones that are left out; of equal ones the first decides."""
    prescribed = [rule for rule in rules if rule["use"] == use]
    candidates, left_out = [], []
    if hazard is not None and hazard.get("recommended") is not None:
        candidates.append(_Candidate(hazard["recommended"], f"the {_COMPUTED}"))
    elif hazard is not None:
        left_out.append(LeftOut(_COMPUTED, f"it is {NOT_DETERMINED}: {hazard.get('reason', '')}", None, missing=True))
    if official.get(_HAZARDOUS) is not None:
        candidates.append(_Candidate(official[_HAZARDOUS], "the official hazardous fragment distance"))
    if use == DISPOSAL and official.get(_MAXIMUM) is not None:
        candidates.append(_Candidate(official[_MAXIMUM], "the official maximum fragment distance"))
    candidates += [
        _Candidate(rule["distance"], f"the rule “{rule['name']}” ({rule['hazard']})")
        for rule in prescribed
        if rule["distance"] is not None
    ]
    largest = max(candidates, key=lambda one: one.distance, default=None)
    left_out += [
        LeftOut(rule["name"], rule["reason"], rule["outside"], missing=rule["missing"])
        for rule in prescribed
        if rule["distance"] is None
        and (rule["missing"] if rule["outside"] is None else largest is None or rule["outside"] > largest.distance)
    ]
    return DistanceOfUse(largest and largest.distance, largest and largest.by, tuple(left_out))


def official_part(case: CaseTable) -> dict[str, Any] | None:
    """The part `official` of summary.json: the table of a resolved case and how many rounds stand there; None without.

    `covers` is whether the distances are published for as many rounds as stand there with their images, all `alike`;
    None where the fragments come from another source and no rounds are known.
    """
    if case.official is None:
        return None
    here = len(with_images(case)) if case.round else None
    alike = are_alike(case) if case.round else None
    covers = None if here is None else here <= case.official.rounds and bool(alike)
    return {**case.official.model_dump(), "rounds_here": here, "alike": alike, "covers": covers}


def _official_words(
    hazard: Mapping[str, Any], computed: float | None, official: Mapping[str, Any] | None
) -> Iterator[str]:
    """Official against computed distances."""
    if official is None:
        yield "No official distance of the round is in the case (table [official])."
        return
    determined = bool(hazard.get("determined"))
    if official.get(_HAZARDOUS) is not None and hazard:
        yield _against_hazardous(official[_HAZARDOUS], computed, _without_ricochet(hazard))
    if official.get(_MAXIMUM) is not None and hazard:
        yield _against_maximum(official[_MAXIMUM], hazard.get("largest_throw") if determined else None)
    if note := official_note(official):
        yield note


def _without_ricochet(hazard: Mapping[str, Any]) -> str:
    """The computed distance up to the first impact on the ground, which published ones usually mean; or nothing."""
    short = hazard.get("without_ricochet")
    if not hazard.get("determined") or not short or hazard.get("ricochet", "none") == "none":
        return ""
    return f" (without ricochet {metres(short['recommended'])})"


def _against_hazardous(official: float, computed: float | None, beside: str) -> str:
    """The official hazardous fragment distance (m) against the recommended one, which may not be determined."""
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
    """The official maximum fragment distance (m) against the throw of one event in 20, if that is determined."""
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


def official_note(official: Mapping[str, Any]) -> str:
    """That the official distance is for fewer rounds than stand there, or that this is not known; empty otherwise."""
    number = int(official.get("rounds") or 1)
    published = f"published for {'one round' if number == 1 else f'{number} rounds'}"
    if official.get("covers") is None:
        return f"The official distances are {published}; how many rounds the fragments come from is not known here."
    if official["covers"]:
        return ""
    if official.get("alike") is False:
        return f"The official distances are {published}; rounds of different kinds stand here, which they do not cover."
    return f"The official distances are {published}; {official['rounds_here']} stand here, which they do not cover."
