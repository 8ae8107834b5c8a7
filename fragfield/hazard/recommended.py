"""The recommended distance: the expected distance, and what is not known of it, added up.

    recommended = expected + sqrt(quadrature^2 + randomness^2 + grid^2 + inputs^2)

Every part beside the expected distance is the half-width of its one-sided band of 95 %. Where the expected density is
an integral there is no randomness, and the quadrature is the bound of its points, some tenths of a metre; elsewhere
the randomness is the upper bound over the realisations less the expected distance. Of the grid it is the whole grid
convergence index, a band about a limit that lies to one side; of the inputs their 95 % quantile less the expected
distance. Independent contributions at one level are added as squares, as ASME V&V 20 (2009) adds the standard
uncertainties of inputs and numerics. A part that is not known is not in the sum; `not_included` says why.

A computed distance is no leave to stay below a prescribed one, nor a prescribed one leave to stay below a larger
computed one: the largest of recommended and official distance and of the rules in range is the one not to go below.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any, NamedTuple

from fragfield.case.conversion.rounds import are_alike
from fragfield.hazard.certainty import metres, whole_metres
from fragfield.hazard.contents import DISPOSAL, SITING

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from fragfield.case import CaseTable


PARTS = {
    "expected": "expected distance",
    "quadrature": "points of the integral",
    "randomness": "randomness of the break-up",
    "grid": "grid",
    "inputs": "inputs",
}
"""The parts of the recommended distance, in words."""
RULE = (
    "Expected distance plus the root of the sum of squares of the other parts, each the half-width of its one-sided "
    "band of 95 %."
)
_WIDTHS = tuple(PARTS)[1:]
_NO_GRID = "no grid convergence: "


class Part(NamedTuple):
    """A part of the recommended distance: in words, its m (None where it is not known) and why it is not included."""

    words: str
    value: float | None
    reason: str


def recommended_of(
    hazard: Mapping[str, Any], convergence: Mapping[str, Any] | None, study: Mapping[str, Any] | None = None
) -> dict[str, Any]:
    """The part `hazard` of summary.json with the recommended distance.

    Parameters
    ----------
    hazard, convergence : mapping
        Parts of summary.json.
    study : mapping, optional
        uncertainty.json of a study of this run.

    Returns
    -------
    dict
        `hazard` with `recommended` (m; None where the distance is not determined), `parts` (m, by the names
        of `PARTS`; `expected` is the expected distance, the others half-widths, None where not known), `not_included`
        (why, by the name of the part), and `recommended` in `without_ricochet`, with the same half-widths but those of
        quadrature and randomness.
    """
    found = dict(hazard)
    short = dict(found.get("without_ricochet") or {})
    if not hazard.get("determined") or hazard.get("expected") is None:
        empty: dict[str, Any] = {"recommended": None, "parts": dict.fromkeys(PARTS), "not_included": {}}
        return found | empty | ({"without_ricochet": short | {"recommended": None}} if short else {})
    expected = float(hazard["expected"])
    spread = ((study or {}).get("distance") or {}).get("spread")
    grid, no_grid = _grid(convergence or {})
    parts: dict[str, float | None] = {
        "expected": expected,
        **_statistical(hazard, hazard),
        "grid": grid,
        "inputs": None if spread is None else max(float(spread["high"]) - expected, 0.0),
    }
    reasons = {
        "grid": no_grid,
        "inputs": "no study of uncertain inputs" if study is None else "the study of uncertain inputs has no result",
    }
    if hazard.get("method") != "integral":
        reasons["randomness"] = "a single realisation has no bound"
    missing = {name: words for name, words in reasons.items() if parts[name] is None}
    found |= {"recommended": _sum(expected, parts), "parts": parts, "not_included": missing}
    if short:
        beside = parts | _statistical(hazard, short)
        found["without_ricochet"] = short | {"recommended": _sum(float(short["expected"]), beside)}
    return found


def parts_of(hazard: Mapping[str, Any]) -> list[Part]:
    """The parts in their order, with those not included; empty where the distance is not determined."""
    if hazard.get("recommended") is None:
        return []
    missing = hazard["not_included"]
    return [
        Part(PARTS[name], value, missing.get(name, ""))
        for name, value in hazard["parts"].items()
        if value is not None or name in missing
    ]


def parts_words(hazard: Mapping[str, Any]) -> str:
    """The parts in one line, and what is not included; empty where the distance is not determined."""
    rows = parts_of(hazard)
    if not rows:
        return ""
    names = list(PARTS.values())[1:]
    base = f"{rows[0].words} {metres(rows[0].value)}"
    widths = [f"{row.words} {row.value:.1f} m" for row in rows if row.words in names and row.value is not None]
    added = f"; added as squares: {', '.join(widths)}" if widths else ""
    missing = not_included_words(hazard)
    return f"{base}{added}{f'; not included: {missing}' if missing else ''}"


def not_included_words(hazard: Mapping[str, Any]) -> str:
    """What the recommended distance does not include and why, or nothing."""
    return ", ".join(f"{row.words} ({row.reason})" for row in parts_of(hazard) if row.reason)


def _statistical(hazard: Mapping[str, Any], of: Mapping[str, Any]) -> dict[str, float | None]:
    """Half-width (m) of a distance `of` the hazard by its integral's points, or by its realisations."""
    upper = of.get("upper")
    width = None if upper is None else max(float(upper) - float(of["expected"]), 0.0)
    integrated = hazard.get("method") == "integral"
    return {"quadrature": width if integrated else None, "randomness": None if integrated else width}


def _grid(convergence: Mapping[str, Any]) -> tuple[float | None, str]:
    """Half-width (m) by the cell size, or why it is not known."""
    entry = (convergence.get("quantities") or {}).get("expected_distance") or {}
    width = entry.get("uncertainty")
    if width is not None:
        return float(width), ""
    reason = str(convergence.get("reason") or "no other cell size gave a distance")
    return None, reason.removeprefix(_NO_GRID)


def _sum(expected: float, parts: Mapping[str, float | None]) -> float:
    return expected + math.sqrt(sum(width**2 for name in _WIDTHS if (width := parts[name]) is not None))


USES = {SITING: "storage and handling", DISPOSAL: "disposal in the open"}
"""Activities for which distances are prescribed, in words."""
_HAZARDOUS, _MAXIMUM = "hazardous_fragment_distance", "maximum_fragment_distance"


class _Candidate(NamedTuple):
    """A distance (m) that may be the largest, and by what."""

    distance: float
    by: str


def official_part(case: CaseTable) -> dict[str, Any] | None:
    """The part `official` of summary.json: the table of a resolved case and how many rounds stand there; None without.

    `covers` is whether the distances are published for as many rounds as stand there with their images, all `alike`;
    None where the fragments come from another source and no rounds are known.
    """
    from fragfield.hazard.contents import with_images

    if case.official is None:
        return None
    here = len(with_images(case)) if case.round else None
    alike = are_alike(case) if case.round else None
    covers = None if here is None else here <= case.official.rounds and bool(alike)
    return {**case.official.model_dump(), "rounds_here": here, "alike": alike, "covers": covers}


def minimum_part(
    hazard: Mapping[str, Any],
    official: Mapping[str, Any] | None,
    rules: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """The part `minimum` of summary.json: the distances not to go below, of parts `hazard`, `official`, `rules.rules`.

    By use, "siting" and "disposal", `distance` (m; None where nothing is known), `by`, and `words`, sentences for a
    reader.
    """
    computed = hazard.get("recommended")
    part: dict[str, Any] = {}
    closing = []
    for use, title in USES.items():
        candidates = list(_candidates(use, computed, official or {}, rules))
        largest = max(candidates, key=lambda one: one.distance, default=None)
        part[use] = {"distance": largest and largest.distance, "by": largest and largest.by}
        if largest is not None:
            closing.append(f"{title[0].upper()}{title[1:]}: do not apply less than {metres(largest.distance)}, by "
                           f"{largest.by}.")  # fmt: skip
    words = [*_official_words(hazard, computed, official), *_rule_words(computed, rules), *closing]
    return {**part, "words": words}


def _candidates(
    use: str, computed: float | None, official: Mapping[str, Any], rules: Sequence[Mapping[str, Any]]
) -> Iterator[_Candidate]:
    """All distances that are prescribed for a use, and the recommended one; of equal ones the first decides."""
    if computed is not None:
        yield _Candidate(computed, "the recommended distance of this computation")
    if official.get(_HAZARDOUS) is not None:
        yield _Candidate(official[_HAZARDOUS], "the official hazardous fragment distance")
    if use == DISPOSAL and official.get(_MAXIMUM) is not None:
        yield _Candidate(official[_MAXIMUM], "the official maximum fragment distance")
    for rule in rules:
        if rule.get("use") == use and rule["distance"] is not None:
            yield _Candidate(rule["distance"], f"the rule “{rule['name']}” ({rule['hazard']})")


def _official_words(
    hazard: Mapping[str, Any], computed: float | None, official: Mapping[str, Any] | None
) -> Iterator[str]:
    """Official against computed distances."""
    if official is None:
        yield "No official distance of the round is in the case (table [official])."
        return
    determined = bool(hazard.get("determined"))
    if official.get(_HAZARDOUS) is not None:
        yield _against_hazardous(official[_HAZARDOUS], computed, _without_ricochet(hazard))
    if official.get(_MAXIMUM) is not None:
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
            f"The computed throw exceeded in 5 % of events, {ours}, is larger than the {name}, {theirs}: fragments may "
            "land beyond it."
        )
    return f"The {name}, {theirs}, is not exceeded by the computed throw exceeded in 5 % of events, {ours}."


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


def _rule_words(computed: float | None, rules: Sequence[Mapping[str, Any]]) -> Iterator[str]:
    """The largest rule in range of each hazard for storage and handling, against the recommended distance."""
    if not rules:
        yield "No rule was applied: the masses of the rounds are not known here."
    for hazard in ("fragments", "blast"):
        inside = [r for r in rules if r.get("use") == SITING and r["hazard"] == hazard and r["distance"] is not None]
        if not inside:
            if any(rule.get("use") == SITING for rule in rules):
                yield f"No rule against {hazard} for storage and handling is in range."
            continue
        rule = max(inside, key=lambda one: float(one["distance"]))
        relation = ""
        if computed is not None:
            more = whole_metres(computed), whole_metres(rule["distance"])
            relation = ", as much as" if more[0] == more[1] else (
                ", more than" if rule["distance"] > computed else ", less than")  # fmt: skip
            relation += f" the recommended {more[0]} m"
        yield f"Rules in range against {hazard}: {metres(rule['distance'])} ({rule['name']}){relation}."
