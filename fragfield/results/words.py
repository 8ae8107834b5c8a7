"""A run's numbers in words, the same in terminal, report, application and print."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

from fragfield.case.conversion.surroundings import direction_words
from fragfield.numbers import SPACE

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.results.hazard import Hazard, Recommended


NOT_DETERMINED = "not determined"
PARTS = {
    "expected": "expected distance",
    "quadrature": "points of the expected density",
    "randomness": "randomness of the break-up",
    "grid": "grid",
    "table": "groups and zones of the arena table",
    "inputs": "inputs",
}
"""The parts of the recommended distance."""


class Shown(NamedTuple):
    """A distance (m) as views show it: what it is, its value, and what must be known of it."""

    label: str
    value: str
    note: str = ""
    unit: str = ""

    @property
    def lines(self) -> str:
        """As the terminal shows it, with the note below."""
        value = f" {self.value} {self.unit}" if self.unit else f": {self.value}"
        return f"{self.label[0].lower()}{self.label[1:]}{value}\n  {self.note}"


class Part(NamedTuple):
    """A part of the recommended distance: in words, its m (None where it is not known) and why it is not included."""

    words: str
    value: float | None
    reason: str


def headline(hazard: Hazard | None) -> Shown:
    """The recommended distance with its parts, or why there is none: what every view shows."""
    label = "Recommended distance"
    if hazard is None:
        return Shown(label, "–", "not computed")
    if not hazard.determined:
        return Shown(label, NOT_DETERMINED, hazard.reason)
    return Shown(label, whole_metres(hazard.recommended), parts_words(hazard), "m")


def distances(hazard: Hazard) -> Iterator[Shown]:
    """The recommended distance, its parts, and beside it what single events do."""
    shown = headline(hazard)
    if not hazard.determined:
        yield shown
        return
    taken_off = f"; {hazard.max_bias:.2g}{SPACE}m taken off for taking the worst direction" if hazard.max_bias else ""
    expected, *added = parts_of(hazard)
    yield Shown(shown.label, shown.value, f"to keep; {basis_words(hazard)}")
    with_error = metres_and_error(expected.value, hazard.standard_error, SPACE)
    yield Shown("Expected distance", with_error, f"{source_words(hazard)}{taken_off}")
    for part in added:
        value = "–" if part.value is None else f"{part.value:.1f}"
        yield Shown(f"– {part.words}", value, part.reason or "part of it")
    yield Shown("Expected, by area of ground alone", whole_metres(hazard.distance_ground), "density of landings")
    along = "along the paths below a person's height"
    yield Shown("Expected, normal to the paths alone", whole_metres(hazard.distance_normal), along)
    others = ricochet_words(hazard).partition(";")[0]
    short = whole_metres(hazard.without_ricochet.recommended)
    yield Shown("Recommended, without ricochet", short, f"all other distances are {others}")
    if single := hazard.single_event:
        span = f"{rounded_metres(single.low)}{SPACE}–{SPACE}{rounded_metres(single.high)}"
        value = f"{rounded_metres(single.median)}, {span}"
        yield Shown("Single events: median, 5 to 95 %", value, single_note(hazard))
    throw = "no distance to keep: the farthest fragment of an event"
    yield Shown("Throw exceeded in 5 % of events", rounded_metres(hazard.largest_throw), throw)


def parts_of(hazard: Recommended) -> list[Part]:
    """The parts in their order, with those not included; empty where the distance is not determined."""
    if hazard.recommended is None:
        return []
    known = {name: getattr(hazard.parts, name) for name in PARTS}
    missing = hazard.not_included
    return [
        Part(words, known[name], missing.get(name, ""))
        for name, words in PARTS.items()
        if known[name] is not None or name in missing
    ]


def parts_words(hazard: Recommended) -> str:
    """The parts in one line, and what is not included; empty where the distance is not determined."""
    rows = parts_of(hazard)
    if not rows or hazard.recommended is None:
        return ""
    base = f"{rows[0].words} {rows[0].value:.1f} m"
    widths = [f"{row.words} {row.value:.1f} m" for row in rows[1:] if row.value is not None]
    together = math.ceil(10.0 * hazard.recommended - 1e-9) / 10.0
    added = f"; added as squares: {', '.join(widths)}; together {together:.1f} m" if widths else ""
    missing = not_included_words(hazard)
    return f"{base}{added}{f'; not included: {missing}' if missing else ''}"


def not_included_words(hazard: Recommended) -> str:
    """What the recommended distance does not include and why, or nothing."""
    return ", ".join(f"{row.words} ({row.reason})" for row in parts_of(hazard) if row.reason)


def certainty(hazard: Hazard) -> str:
    """Why the distance is not determined, or not known to the tolerance; else empty."""
    if not hazard.determined:
        return f"the distance is not determined: {hazard.reason}"
    if hazard.converged:
        return ""
    number, more, integrated = hazard.realisations, hazard.more_realisations, hazard.method != "realisations"
    if hazard.standard_error is None:
        how = "one realisation was flown" if more else "there is one set of fragments from another source"
        what = "the expected distance has neither a standard error nor an upper bound"
        ask = "set break_up.realisations to 20 or more" if more else "a bound needs those of several events"
        return f"{how}: {what}; {ask}"
    error = hazard.standard_error / hazard.expected if hazard.expected else math.inf
    bias = (hazard.max_bias or 0.0) / hazard.expected if hazard.expected else 0.0
    what = f"{100.0 * error:.2g} % (standard error)"
    if bias > error:
        what = f"{100.0 * bias:.2g} % (taken off for taking the worst direction)"
    ask = (
        f"; set hazard.max_realisations above {number}"
        if more
        else "; no more realisations can be made without the burst's snapshot"
    )
    who, ask = ("the points of the expected density", "") if integrated else (f"{number} realisations", ask)
    return f"{who} fix the expected distance to {what}, not to {100.0 * hazard.tolerance:g} %{ask}"


def source_words(hazard: Hazard) -> str:
    """From what the expected density is, and why no integral."""
    why = f" (no integral: {hazard.not_integrated_because})" if hazard.not_integrated_because else ""
    if hazard.method == "integral":
        return "expected density by integration"
    if hazard.method == "weighted_fragments":
        return f"expected density of weighted fragments{why}"
    return f"mean of {hazard.realisations:,d} realisation{'s' if hazard.realisations > 1 else ''}{why}"


def basis_words(hazard: Hazard) -> str:
    """In which direction the distance holds."""
    inclination, kernel = hazard.attitude.worst_inclination_deg, hazard.kernel_deg
    smoothed = "" if kernel is None else f", smoothed over ±{kernel:.3g}°"
    if inclination is not None and hazard.determined:
        words = f"in every direction: worst attitude, inclined by {inclination:g}°"
        return words if hazard.basis == "all_azimuths" else words + smoothed
    if hazard.basis == "all_azimuths":
        return "over all azimuths"
    if hazard.determined and hazard.direction_deg is not None:
        return f"worst direction, {direction_words(hazard.direction_deg, hazard.bearing_deg)}{smoothed}"
    return f"worst direction{smoothed}"


def ricochet_words(hazard: Hazard) -> str:
    """Off what fragments ricochet, and the recommended distance without."""
    if hazard.ricochet == "none":
        return "without ricochet: every fragment stays where it first meets the ground"
    short = metres(hazard.without_ricochet.recommended)
    return f"with ricochet off {hazard.ricochet.replace('_', ' ')}; without ricochet {short}"


def single_words(hazard: Hazard) -> str:
    """What single events may do: 5 to 95 %."""
    found = hazard.single_event
    return NOT_DETERMINED if found is None else f"{rounded_metres(found.low)} to {rounded_metres(found.high)} m"


def single_note(hazard: Hazard) -> str:
    """What the distances of single events are, and that none of them is one to keep."""
    own = "" if hazard.basis == "all_azimuths" else " in its own worst direction"
    number = 0 if hazard.single_event is None else hazard.single_event.realisations
    return f"no distance to keep: each of {number} events alone{own}"


def whole_metres(value: float | None, otherwise: str = "–") -> str:
    """A distance in whole metres without its unit, as every text, table, figure and console line shows it.

    Rounded up, so that print loses nothing of a distance to keep, and the same number stands everywhere.
    """
    return otherwise if value is None or math.isnan(value) else f"{math.ceil(value - 1e-9):,d}"


def rounded_metres(value: float | None, otherwise: str = "–") -> str:
    """A distance that is none to keep (single events, throws, places) in whole metres without its unit, rounded."""
    return otherwise if value is None or math.isnan(value) else f"{round(value):,d}"


def metres(value: float | None) -> str:
    """A distance in whole metres, rounded up as by `whole_metres`; or that it is not determined."""
    return NOT_DETERMINED if value is None else f"{whole_metres(value)} m"


def margin_metres(value: float | None) -> str:
    """A margin in whole metres with its sign, rounded down: print must not add to it."""
    return "–" if value is None else f"{math.floor(value + 1e-9):+,d}".replace("-", "−")


def metres_and_error(value: float | None, error: float | None, between: str = " ") -> str:
    """A part of a distance, to 0.1 m so that printed parts add up, with its standard error; without the unit."""
    if value is None:
        return NOT_DETERMINED
    return f"{value:,.1f}" if error is None else f"{value:,.1f}{between}±{between}{error:.1f}"
