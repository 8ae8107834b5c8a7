"""The expected density from flights of weighted fragments, in any scene: each stands for many of the intensity.

Several sets of fragments, independent of each other, are flown; their scatter is the error, and takes the place of
that over realisations.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.hazard.density.density_counts import density_counts
from flight.hazard.integral import Integral
from flight.hazard.pool import Completeness
from flight.rows import Status
from flight.scene.air import STANDARD_GRAVITY

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight.fluence import PolarGrid, Weights
    from flight.fragments import Fragments
    from flight.hazard.criteria import Criteria
    from flight.hazard.density.directions import Directions

    Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class WeightedCounts:
    """What the flight of one set gave: densities as of `density_counts`, of whole flights and before the first impact.

    `rest` (r,) are numbers of fragments by the distance at which they come to rest.
    """

    whole: tuple[Array, Array]
    short: tuple[Array, Array]
    rest: Array
    completeness: Completeness


def count_weighted(
    fragments: Fragments, weights: Weights, grid: PolarGrid, criteria: Criteria, **flight_arguments: Any
) -> WeightedCounts:
    """Fly a set of weighted fragments; arguments as of `flight.fly`, without contact."""
    from flight.integrate.fly import fly

    arguments: dict[str, Any] = {"ground": 0.0, "gravity": STANDARD_GRAVITY, **flight_arguments}
    result = fly(fragments, **arguments, fluence=criteria.fluence_grid(grid), weights=weights)
    rows, ground = result.landing, arguments["ground"]
    rested = rows["last_status"] == Status.LANDED
    distance = rows["last_distance"][rested]
    grid = grid.up_to(max(grid.reach, float(distance.max(initial=0.0)) + grid.cell))
    rest = np.bincount(grid.cells_of(0.0, distance)[1], weights=weights.number[rested], minlength=grid.shape[1])
    lowest = float(ground) if isinstance(ground, int | float) else float(ground.heights.min())
    complete = Completeness.of(result, fragments, criteria.energy, lowest=lowest, gravity=arguments["gravity"])
    return WeightedCounts(
        density_counts(result), density_counts(result, ricochet=False), rest.astype(np.float64), complete
    )


def expected_of(sets: Sequence[WeightedCounts], directions: Directions, criteria: Criteria) -> Integral:
    """The expected numbers of fragments by direction and distance, from two sets or more that are independent."""
    cells = max(len(one.rest) for one in sets)
    rows = 1 if directions.axisymmetric else directions.grid.shape[0]
    fields = np.zeros((2, len(sets), 2, rows, cells))
    for number, one in enumerate(sets):
        for leg, counts in enumerate((one.whole, one.short)):
            for kind, values in enumerate(counts):
                folded = values.sum(axis=0, keepdims=True) if directions.axisymmetric else values
                fields[leg, number, kind, :, : values.shape[1]] = folded
    rest = np.zeros(cells)
    for one in sets:
        rest[: len(one.rest)] += one.rest / len(sets)
    first = fields[1, :, 0].sum(axis=(1, 2))
    error = float(first.std(ddof=1) / math.sqrt(len(sets)))
    return Integral(directions, fields, criteria, rest, float(first.mean()), error, "weighted_fragments")
