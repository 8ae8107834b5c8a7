"""Hazards of two runs: distances with their errors, and densities by distance."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.studies.compare.estimates import Estimates, compared

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flight.hazard.density.distance import ExpectedDistance
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

DENSITIES = ("ground_density", "normal_density")
"""Hazardous fragments (1/m2) by area of ground and normal to paths, over all azimuths or in the worst direction."""
_SPAN = 2.0 * 1.6448536269514722  # standard errors from 5 to 95 %


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
    """One row a distance: `distance_m` and, for each of DENSITIES, a table as `estimates.compared` has it.

    Expected densities in the directions that decide, with the standard errors of the bootstrap; none beyond a run's
    farthest hazardous fragment. Empty where the runs estimate at different distances.
    """
    curves = run.expected, reference.expected
    radius = max((one.radius for one in curves), key=len)
    if not all(np.array_equal(radius[: len(one.radius)], one.radius) for one in curves):
        return []
    columns = {
        name: compared(*(_density(one, kind, len(radius)) for one in curves)) for kind, name in enumerate(DENSITIES)
    }
    return [
        {"distance_m": float(distance), **dict(zip(columns, row, strict=True))}
        for distance, row in zip(radius, zip(*columns.values(), strict=True), strict=True)
    ]


def _density(found: ExpectedDistance, kind: int, places: int) -> Estimates:
    beyond = (0, places - len(found.radius))
    error = np.full(len(found.radius), np.nan)
    if found.density_low.size:
        error = (found.density_high[kind] - found.density_low[kind]) / _SPAN
    return Estimates(np.pad(found.density[kind], beyond), np.pad(error, beyond))
