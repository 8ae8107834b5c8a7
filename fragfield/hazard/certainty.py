"""Statements on the distances of a run: whether they are determined, and how accurately."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.surroundings import bearing_of, direction_words, ground_of

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flight.hazard.density.distance import ExpectedDistance
    from fragfield.case import CaseTable


NOT_DETERMINED = "not determined"


def is_determined(summary: Mapping[str, Any]) -> bool:
    """Whether the distance of a summary is determined, or none was to be computed."""
    return bool((summary.get("hazard") or {}).get("determined", True))


def certainty(hazard: Mapping[str, Any]) -> str:
    """Why the distance of summary.json's part "hazard" is not determined, or not known to the tolerance; else empty."""
    if not hazard.get("determined", True):
        return f"the distance is not determined: {hazard['reason']}"
    if hazard.get("converged", True):
        return ""
    number, more = hazard["realisations"], hazard.get("more_realisations", True)
    integrated = hazard.get("method", "realisations") != "realisations"
    if hazard.get("standard_error") is None:
        how = "one realisation was flown" if more else "there is one set of fragments from another source"
        what = "the expected distance has neither a standard error nor an upper bound"
        ask = "set break_up.realisations to 20 or more" if more else "a bound needs those of several events"
        return f"{how}: {what}; {ask}"
    error = hazard["standard_error"] / hazard["expected"] if hazard["expected"] else math.inf
    ask = (
        f"set hazard.max_realisations above {number}"
        if more
        else "no more realisations can be made without the burst's snapshot"
    )
    bias = hazard["max_bias"] / hazard["expected"] if hazard["expected"] else 0.0
    what = f"{100.0 * error:.2g} % (standard error)"
    if bias > error:
        what = f"{100.0 * bias:.2g} % (taken off for taking the worst direction)"
    who, ask = ("the points of the expected density", "") if integrated else (f"{number} realisations", f"; {ask}")
    return f"{who} fix the expected distance to {what}, not to {100.0 * hazard['tolerance']:g} %{ask}"


def source_words(hazard: Mapping[str, Any]) -> str:
    """From what the expected density is, and why no integral."""
    why = f" (no integral: {hazard['not_integrated_because']})" if hazard.get("not_integrated_because") else ""
    if hazard.get("method") == "integral":
        return "expected density by integration"
    if hazard.get("method") == "weighted_fragments":
        return f"expected density of weighted fragments{why}"
    number = int(hazard["realisations"])
    return f"mean of {number:,d} realisation{'s' if number > 1 else ''}{why}"


def basis_words(hazard: Mapping[str, Any]) -> str:
    """In which direction the distance holds, in words."""
    attitude = hazard.get("attitude") or {}
    if attitude.get("worst_inclination_deg") is not None and hazard.get("determined"):
        words = f"in every direction: worst attitude, inclined by {attitude['worst_inclination_deg']:g}°"
        smoothed = "" if hazard.get("basis") == "all_azimuths" else f", smoothed over ±{hazard['kernel_deg']:.3g}°"
        return words + smoothed
    if hazard.get("basis") == "all_azimuths":
        return "over all azimuths"
    words = "worst direction"
    if hazard.get("determined"):
        words += f", {direction_words(hazard['direction_deg'], hazard.get('bearing_deg'))}"
    return f"{words}, smoothed over ±{hazard['kernel_deg']:.3g}°"


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


def ricochet_words(hazard: Mapping[str, Any]) -> str:
    """Off what fragments ricochet, and the recommended distance without; empty in older summaries."""
    short = hazard.get("without_ricochet")
    if not short:
        return ""
    kind = hazard.get("ricochet", "none")
    if kind == "none":
        return "without ricochet: every fragment stays where it first meets the ground"
    return f"with ricochet off {kind.replace('_', ' ')}; without ricochet {metres(short['recommended'])}"


def single_words(hazard: Mapping[str, Any]) -> str:
    """What single events may do: 5 to 95 %."""
    found = hazard.get("single_event")
    if not found:
        return NOT_DETERMINED
    return f"{rounded_metres(found['low'])} to {rounded_metres(found['high'])} m"


def single_note(hazard: Mapping[str, Any]) -> str:
    """What the distances of single events are, and that none of them is one to keep."""
    own = "" if hazard.get("basis") == "all_azimuths" else " in its own worst direction"
    return f"no distance to keep: each of {hazard['single_event']['realisations']} events alone{own}"


def beyond_map_words(case: CaseTable, expected: ExpectedDistance) -> str:
    """Why a distance is not determined that reaches beyond the map, where the ground is not known; else empty.

    `expected` is the distance of the flights of the resolved case.
    """
    ground = ground_of(case)
    if isinstance(ground, float):
        return ""
    reach = ground.reach(case.flight.origin, expected.azimuth)
    if expected.direction is None:  # one distance for every direction
        reach = ground.reach(case.flight.origin, np.arange(360.0)).min(keepdims=True)
    distance = np.fmax(expected.by_direction, expected.upper_by_direction)
    farthest = int(np.argmax(distance - reach))
    if not distance[farthest] > reach[farthest]:
        return ""
    turn = float(expected.azimuth[farthest])
    where = "" if expected.direction is None else f", {direction_words(turn, bearing_of(case, turn), whole=True)}"
    return (
        f"over level ground beyond the map of heights it would be {distance[farthest]:.0f} m{where}, and the map ends "
        f"{reach[farthest]:.0f} m from the rounds; take a larger map"
    )
