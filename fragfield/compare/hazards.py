"""Hazards of two runs on the ground: distances with their bands, and densities by distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from flight.distances import DISTANCES
from fragfield.compare.estimates import Estimates, compared, estimate

if TYPE_CHECKING:
    from flight.ensemble import EnsembleHazard
    from flight.tally import Tally
    from fragfield.compare.runs import ComparedRun

__all__ = ["DENSITIES", "compare_densities", "compare_distances"]

DENSITIES = ("ground_density", "normal_density", "worst_ground_density", "worst_normal_density")
"""Hazardous fragments (1/m2) by area of ground and normal to paths, over all azimuths and in the densest sector."""


def compare_distances(run: ComparedRun, reference: ComparedRun) -> list[dict[str, Any]]:
    """One row a distance: medians with bands and their ratio, and the pooled ones and theirs.

    A largest throw of all realisations grows with their number, so that throws have no pooled ratio.
    """
    ours, theirs = run.part("flight"), reference.part("flight")
    rows = []
    for name, label in DISTANCES.items():
        if ours.get(name) is None or theirs.get(name) is None:
            continue
        bands = [(part.get("bands") or {}).get(name) or {} for part in (ours, theirs)]
        row: dict[str, Any] = {"name": name, "label": label}
        row |= compared(
            *(_single(part[name], band.get("standard_error")) for part, band in zip((ours, theirs), bands, strict=True))
        )[0]
        for key, band in zip(("run", "reference"), bands, strict=True):
            row |= {f"{key}_{edge}": band.get(edge) for edge in ("low", "high")}
        pooled = [_single(band.get("pooled"), band.get("pooled_standard_error")) for band in bands]
        together = {f"pooled_{key}": value for key, value in compared(*pooled)[0].items()}
        if name == "max_range":
            together = dict.fromkeys(together)
        rows.append(row | together)
    return rows


def _single(value: float | None, error: float | None) -> Estimates:
    return Estimates(np.array([np.nan if value is None else value]), np.array([np.nan if error is None else error]))


def compare_densities(run: EnsembleHazard, reference: EnsembleHazard) -> list[dict[str, Any]]:
    """One row a distance cell: `distance_m` and, for each of DENSITIES, a table as `estimates.compared` has it.

    Means over the realisations; cells beyond a run's farthest landing hold nothing. Empty where the runs count in cells
    or sectors of different size.
    """
    edges = max((run.counts.edges, reference.counts.edges), key=len)
    for counts in (run.counts, reference.counts):
        if not np.array_equal(edges[: len(counts.edges)], counts.edges):
            return []
    if run.counts.throw.shape[1] != reference.counts.throw.shape[1]:
        return []
    mine, other = (_densities(one.counts.up_to(edges)) for one in (run, reference))
    columns = {name: compared(mine[name], other[name]) for name in DENSITIES}
    centres = 0.5 * (edges[:-1] + edges[1:])
    return [
        {"distance_m": float(centre), **dict(zip(columns, row, strict=True))}
        for centre, row in zip(centres, zip(*columns.values(), strict=True), strict=True)
    ]


def _densities(counts: Tally) -> dict[str, Estimates]:
    ground, normal = counts.landings / counts.area, counts.tracks / counts.area
    each = (ground.mean(axis=1), normal.mean(axis=1), ground.max(axis=1), normal.max(axis=1))
    return {name: estimate(values) for name, values in zip(DENSITIES, each, strict=True)}
