"""Hazards of two runs: distances with their errors, and densities by distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.studies.compare.estimates import Estimates, compared, estimate

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flight.hazard.density.tally import Tally
    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.studies.compare.runs import ComparedRun

_DISTANCES = (
    ("recommended", "recommended distance", None),
    ("expected", "expected distance", "standard_error"),
    ("without_ricochet.recommended", "recommended, without ricochet", None),
    ("without_ricochet.expected", "expected, without ricochet", "without_ricochet.standard_error"),
    ("largest_throw", "largest throw", None),
)

__all__ = ["DENSITIES", "compare_densities", "compare_distances"]

DENSITIES = ("ground_density", "normal_density", "worst_ground_density", "worst_normal_density")
"""Hazardous fragments (1/m2) by area of ground and normal to paths, over all azimuths and in the densest sector."""


def compare_distances(run: ComparedRun, reference: ComparedRun) -> list[dict[str, Any]]:
    """One row a distance, as `estimates.compared` has it.

    Of the recommended distance, the expected one, both without ricochet, and the largest throw.
    A distance that is not determined is None, and so is its ratio. `run_basis` and `reference_basis` say in which
    direction the distances hold; a largest throw has none, and no error: it grows with the realisations.
    """
    ours, theirs = run.part("hazard"), reference.part("hazard")
    if not ours or not theirs:
        return []
    rows = []
    for name, label, error in _DISTANCES:
        values = (_single(_at(part, name), _at(part, error) if error else None) for part in (ours, theirs))
        row: dict[str, Any] = {"name": name, "label": label, **compared(*values)[0]}
        bases = (None, None) if name == "largest_throw" else (ours.get("basis"), theirs.get("basis"))
        rows.append(row | dict(zip(("run_basis", "reference_basis"), bases, strict=True)))
    return rows


def _at(part: Mapping[str, Any], name: str) -> float | None:
    """A number by its dotted name; None where it is missing."""
    found: Any = part
    for step in name.split("."):
        found = (found or {}).get(step)
    return None if found is None else float(found)


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
