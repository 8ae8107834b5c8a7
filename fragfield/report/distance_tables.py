"""The tables of distances: each with the number of realisations that it rests on and its band."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from flight.distances import DISTANCES
from fragfield.report.blocks import Table
from fragfield.report.landings import ensemble, hazard_density
from fragfield.report.quantities import SPACE, number

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping

    from flight.ensemble import EnsembleHazard
    from fragfield.report.run_files import RunFiles

__all__ = ["band_words", "density_table", "distance_table", "sector_table", "stack_rule_table"]

_RULE_ROWS = ("hazardous_fragment_distance_all_round", "hazardous_fragment_distance")


def distance_table(run: RunFiles) -> Iterator[Table]:
    """Every distance over all sectors: median, band, pooled, their standard errors, and the verdict."""
    found = ensemble(run)
    if found is None:
        return
    lines = []
    for name, band in found.bands.items():
        pooled = _with_error(band.pooled, band.pooled_standard_error)
        lines.append(
            (
                _capital(DISTANCES[name]),
                _with_error(band.median, band.standard_error),
                _span(band.low, band.high) if found.realisations > 1 else "–",
                f"largest {pooled}" if name == "max_range" else pooled,
                _rounded(band.change_between_halves, sign=True),
                number(band.realisations),
                "yes" if band.converged else "no",
            )
        )
    head = ("Distance (m)", "Median", "5 to 95 %", "Pooled", "2nd half − 1st", "Realisations", "Converged")
    note = (
        "Median and band are those of single realisations of the break-up; pooled is the distance at which the mean "
        "density over all of them is acceptable. ± is the standard error by bootstrap. Converged: at least ten "
        f"realisations, and standard errors within {100 * found.tolerance:g} % of the distance."
    )
    yield Table("Distances and their certainty", head, tuple(lines), note)


def density_table(run: RunFiles) -> Iterator[Table]:
    """Density of hazardous fragments and probability of a hit at a few distances, for the summary."""
    found = ensemble(run)
    if found is None or not found.pooled.hazardous.any():
        return
    curves, area = found.by_distance, 1.0 / hazard_density(run)
    lines = []
    for cell in _few_cells(found):
        densest = max(float(curves[f"worst_{name}_density"].pooled[cell]) for name in ("ground", "normal"))
        line = [f"{found.counts.edges[cell]:,.0f}{SPACE}–{SPACE}{found.counts.edges[cell + 1]:,.0f}"]
        for name in ("ground", "normal"):
            curve = curves[f"{name}_density"]
            line.append(_share(area * curve.pooled[cell]))
            if name == "ground":
                several = found.realisations > 1
                line.append(_share_span(area * curve.low[cell], area * curve.high[cell]) if several else "–")
        lines.append((*line, _share(area * densest), _share(float(curves["probability"].pooled[cell]))))
    head = ("Distance (m)", "On the ground", "5 to 95 %", "Normal to the path", "Densest sector", "Hit on a person")
    note = (
        f"Hazardous fragments per {area:.1f} m², mean of {number(found.realisations)} "
        f"realisation{'s' if found.realisations > 1 else ''}, over all azimuths and in the densest sector (the larger "
        "of both densities); 1 is the acceptable density. Last: probability of a hit on a person at a random azimuth."
    )
    yield Table("Density by distance", head, tuple(lines), note)


def _few_cells(found: EnsembleHazard, most: int = 8) -> list[int]:
    """About `most` distance cells, evenly spread to half as far again as the hazardous fragment distance reaches."""
    farthest = 1.5 * found.bands["hazardous_fragment_distance"].high
    last = int(np.flatnonzero(found.by_distance["ground_density"].pooled > 0).max(initial=0))
    last = min(last, max(1, int(np.searchsorted(found.distance, farthest))))
    return sorted({round(cell) for cell in np.linspace(0, last, min(most, last + 1))})


def _share(value: float) -> str:
    """A density in parts of the acceptable one, or a probability: two digits, however small."""
    return "0" if value <= 0.0 else number(float(f"{value:.2g}"), 2)


def _share_span(low: float, high: float) -> str:
    return f"{_share(low)}{SPACE}–{SPACE}{_share(high)}"


def sector_table(run: RunFiles) -> Iterator[Table]:
    """Distances of every azimuth sector with their bands."""
    found = ensemble(run)
    if found is None:
        return
    curves = found.by_sector
    distance, throw = curves["hazardous_fragment_distance"], curves["max_throw"]
    several = found.realisations > 1
    lines = [
        (
            f"{azimuth:.0f}",
            number(round(float(curves["hazardous"].pooled[i]), 1)),
            _rounded(distance.median[i]),
            _span(distance.low[i], distance.high[i]) if several else "–",
            _rounded(distance.pooled[i]),
            _rounded(throw.median[i]),
            _span(throw.low[i], throw.high[i]) if several else "–",
        )
        for i, azimuth in enumerate(found.azimuth)
    ]
    head = (
        "Azimuth (°)", "Hazardous, mean", "Hazard distance (m), median", "5 to 95 %", "Pooled", "Farthest (m), median",
        "5 to 95 %",
    )  # fmt: skip
    note = (
        f"Of {number(found.realisations)} realisations. Hazard distance: the larger of both densities'; 0 where the "
        "acceptable density is never reached."
    )
    yield Table("Distances by sector", head, tuple(lines), note)


def stack_rule_table(run: RunFiles) -> Iterator[Table]:
    """TP-12's rule for stacks beside the direct result."""
    rule = run.part("flight").get("stack_rule")
    found = ensemble(run)
    if not isinstance(rule, dict) or found is None:
        return
    lines = []
    for name in _RULE_ROWS:
        direct, by_rule = found.bands[name], rule["bands"][name]
        lines.append(
            (
                _capital(DISTANCES[name]),
                _with_error(direct.pooled, direct.pooled_standard_error),
                _with_error(by_rule["pooled"], by_rule["pooled_standard_error"]),
                f"{direct.pooled / by_rule['pooled']:.2f}" if by_rule["pooled"] else "–",
            )
        )
    head = ("Pooled distance (m)", f"Direct, {number(found.realisations)} realisations", _rule_words(rule), "Ratio")
    weights = "0.9 and 0.1" if rule["cover"] == "open" else "0.7 and 0.1"
    note = (
        f"The rule of DDESB TP-12 takes {weights} of the {number(rule['side'])} rounds on the fullest side and of the "
        f"{number(rule['top'])} on top: {rule['effective_number']:.3g} times the field of the single round of "
        f"{rule['single']}. It knows nothing of casings that meet."
    )
    yield Table("Rule for stacks", head, tuple(lines), note)


def band_words(run: RunFiles, name: str) -> str:
    """What a distance of the summary rests on, in a few words."""
    found = ensemble(run)
    if found is None:
        return ""
    band = found.bands[name]
    if found.realisations < 2:
        return "one realisation, no band"
    pooled = "largest" if name == "max_range" else "pooled"
    return (
        f"median of {number(found.realisations)} realisations; 5 to 95 %: {_span(band.low, band.high)}{SPACE}m; "
        f"{pooled} {_rounded(band.pooled)}{SPACE}m"
    )


def _capital(words: str) -> str:
    return words[0].upper() + words[1:]


def _rule_words(rule: Mapping[str, Any]) -> str:
    return f"Rule, {rule['effective_number']:.3g} single rounds, {number(rule['realisations'])} realisations"


def _span(low: float, high: float) -> str:
    return f"{low:,.0f}{SPACE}–{SPACE}{high:,.0f}"


def _with_error(value: float, error: float | None) -> str:
    if error is None:
        return _rounded(value)
    return f"{value:,.0f}{SPACE}±{SPACE}{error:.{1 if error < 9.95 else 0}f}"


def _rounded(value: float | None, *, sign: bool = False) -> str:
    if value is None:
        return "–"
    text = f"{value:+,.0f}" if sign else f"{value:,.0f}"
    return text.replace("-", "−")
