"""Tables of distances: the recommended distance with its parts, and the distances of single events."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.case.conversion.site import direction_words, site_of
from fragfield.hazard.certainty import basis_words, metres_and_error, ricochet_words, rounded_metres, whole_metres
from fragfield.hazard.recommended import parts_words
from fragfield.report.blocks import Table
from fragfield.report.quantities import SPACE, number
from fragfield.report.reading.landings import ensemble, hazard_density

if TYPE_CHECKING:
    from collections.abc import Iterator

    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["density_table", "distance_table", "sector_table"]


def distance_table(run: RunFiles) -> Iterator[Table]:
    """The recommended distance with its parts, and beside it what single events do."""
    hazard = run.part("hazard")
    if not hazard:
        return
    if not hazard["determined"]:
        lines = [("Recommended distance", "not determined", hazard["reason"])]
        yield Table("Distances", ("Distance (m)", "Value", "What it is"), tuple(lines), "")
        return
    error, where = hazard["standard_error"], basis_words(hazard)
    short = hazard.get("without_ricochet") or dict.fromkeys(("recommended", "expected", "standard_error"))
    count = number(hazard["realisations"])
    bias = f"; bias of taking the worst direction: ±{hazard['max_bias']:.2g}{SPACE}m at most"
    single = hazard["single_event"]
    lines = [
        ("Recommended distance", whole_metres(hazard["recommended"]), f"{parts_words(hazard)}; {where}"),
        (
            "Expected distance", metres_and_error(hazard["expected"], error, SPACE),
            f"of the expected density, mean of {count} realisations{bias if hazard['max_bias'] else ''}",
        ),
        ("… by area of ground alone", whole_metres(hazard["distance_ground"]), "expected density of landings"),
        (
            "… normal to the paths alone", whole_metres(hazard["distance_normal"]),
            "along the paths below a person's height",
        ),
        ("Recommended, without ricochet", whole_metres(short["recommended"]), "up to the first impact on the ground"),
        (
            "Expected, without ricochet", metres_and_error(short["expected"], short["standard_error"], SPACE),
            f"all other distances are {ricochet_words(hazard).partition(';')[0]}",
        ),
        (
            "Single events: median, 5 to 95 %",
            f"{rounded_metres(single['median'])}, {_span(single['low'], single['high'])}",
            "no distance to keep: where the fragment density of one event falls below the limit",
        ),
        ("Largest throw", rounded_metres(hazard["largest_throw"]), "no distance to keep: farthest single fragment"),
    ]  # fmt: skip
    note = "± is the standard error by bootstrap over the realisations." + _tilt_words(run)
    yield Table("Distances", ("Distance (m)", "Value", "What it is"), tuple(lines), note)


def _tilt_words(run: RunFiles) -> str:
    """How far from plumb the realisations stand; nothing where they are upright, or were flown from a file."""
    deviation = run.part("break_up").get("tilt_deviation") or 0.0
    if not deviation:
        return ""
    return (
        " Every realisation is tilted at random from the vertical, by a standard deviation of "
        f"{np.degrees(deviation):.3g}° about each horizontal axis (break_up.tilt, a judgement)."
    )


def density_table(run: RunFiles) -> Iterator[Table]:
    """Density of hazardous fragments and probability of a hit at a few distances, for the summary."""
    found = ensemble(run)
    if found is None or not found.pooled.hazardous.any():
        return
    curves, area = found.by_distance, 1.0 / hazard_density(run)
    lines = []
    for cell in _few_cells(found):
        line = [f"{found.counts.edges[cell]:,.0f}{SPACE}–{SPACE}{found.counts.edges[cell + 1]:,.0f}"]
        for name in ("ground", "normal"):
            curve = curves[f"{name}_density"]
            line.append(_share(area * curve.pooled[cell]))
            if name == "ground":
                several = found.realisations > 1
                line.append(_share_span(area * curve.low[cell], area * curve.high[cell]) if several else "–")
        lines.append((*line, _share(float(curves["probability"].pooled[cell]))))
    head = ("Distance (m)", "On the ground", "5 to 95 %", "Normal to the path", "Hit on a person")
    note = (
        f"Hazardous fragments per {area:.1f} m², mean of {number(found.realisations)} "
        f"realisation{'s' if found.realisations > 1 else ''}, over all azimuths; 1 is the acceptable density; "
        "5 to 95 % are those of single events. Last column: probability of a hit on a person at a random azimuth."
    )
    yield Table("Density by distance", head, tuple(lines), note)


def _few_cells(found: EnsembleHazard, most: int = 8) -> list[int]:
    """About `most` distance cells, evenly spread to half as far again as the hazardous fragment distance reaches."""
    assert found.expected is not None  # of every run that this version has flown
    farthest = 1.5 * (found.expected.upper or found.expected.distance)
    last = int(np.flatnonzero(found.by_distance["ground_density"].pooled > 0).max(initial=0))
    last = min(last, max(1, int(np.searchsorted(found.distance, farthest))))
    return sorted({round(cell) for cell in np.linspace(0, last, min(most, last + 1))})


def _share(value: float) -> str:
    """A density in parts of the acceptable one, or a probability: two digits, however small."""
    return "0" if value <= 0.0 else number(float(f"{value:.2g}"), 2)


def _share_span(low: float, high: float) -> str:
    return f"{_share(low)}{SPACE}–{SPACE}{_share(high)}"


def sector_table(run: RunFiles) -> Iterator[Table]:
    """Expected distance by direction, and what single events do by sector."""
    found = ensemble(run)
    if found is None or found.expected is None:
        return
    throw, hazardous = found.by_sector["max_throw"], found.by_sector["hazardous"]
    expected, known = found.expected, not found.undetermined
    several, site = found.realisations > 1, None if run.case is None else site_of(run.case)
    lines = []
    for i, azimuth in enumerate(found.azimuth):
        at = round(float(azimuth) / 360.0 * len(expected.azimuth)) % len(expected.azimuth)
        upper, distance = expected.upper_by_direction[at], expected.by_direction[at]
        lines.append(
            (
                f"{azimuth:.0f}" if site is None else direction_words(azimuth, float(site.bearing_of(azimuth))),
                number(round(float(hazardous.pooled[i]), 1)),
                whole_metres(upper) if known else "–",
                whole_metres(distance) if known else "–",
                rounded_metres(throw.median[i]),
                _span(throw.low[i], throw.high[i]) if several else "–",
            )
        )
    head = (
        "Azimuth (°)" if site is None else "Direction", "Hazardous, mean", "Expected (m), upper bound", "Expected (m)",
        "Farthest (m), median", "5 to 95 %",
    )  # fmt: skip
    same = " The expected distance is that over all azimuths." if expected.direction is None else ""
    note = (
        f"Expected distance of {number(expected.realisations)} realisations; 0 where the acceptable density is never "
        f"reached.{same} Farthest fragment of single events."
    )
    yield Table("Distances by direction", head, tuple(lines), note)


def _span(low: float, high: float) -> str:
    return f"{rounded_metres(low)}{SPACE}–{SPACE}{rounded_metres(high)}"
