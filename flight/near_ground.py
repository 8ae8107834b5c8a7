"""Where fragments pass below a person's height with enough energy to hurt: what a flight is asked to count."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.errors import InputError
from flight.result import Status
from flight.tally import SHALLOWEST

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.kernels import near_ground
    from flight.polar_grid import PolarGrid
    from flight.result import FlightResult
    from flight.tally import Criteria

SHORTEST = 0.2  # of a distance cell: a piece of a path, where a tenth of its distance is less

__all__ = ["NearGround", "PathLengths", "fields_of"]


@dataclass(frozen=True, eq=False)
class NearGround:
    """What `flight.fly` counts along the paths: their lengths below a person's height above the ground.

    A fragment counts where its kinetic energy at that place is that of `criteria.energy` or more. After a rebound its
    path counts on; a slide does not.

    Attributes
    ----------
    grid : PolarGrid
        Cells; where fragments pass farther than its reach, `fly` extends it.
    criteria : Criteria
        Energy and height.
    """

    grid: PolarGrid
    criteria: Criteria

    def table(self) -> near_ground.NearGround:
        """For the kernels."""
        from flight.kernels import near_ground

        grid = self.grid
        return near_ground.NearGround(
            float(self.criteria.person_height), float(self.criteria.energy), float(grid.cell),
            1.0 / float(grid.cell), SHORTEST * float(grid.cell), grid.parts, grid.cell / grid.parts, grid.first,
            math.radians(grid.start), 1.0 / math.radians(grid.width),
        )  # fmt: skip


@dataclass(frozen=True, eq=False, repr=False)
class PathLengths:
    """Lengths of the paths of hazardous fragments below a person's height.

    Attributes
    ----------
    near : NearGround
        What was counted; its grid reaches as far as needed.
    lengths : (turns, r) float64
        Of all fragments by cell of the grid (m).
    """

    near: NearGround
    lengths: NDArray[np.float64]

    def __repr__(self) -> str:
        turns, cells = self.lengths.shape
        return f"<flight.PathLengths: {self.lengths.sum():.4g} m in {turns} x {cells} cells>"

    @classmethod
    def of(cls, near: NearGround, counted: list[NDArray[np.int64]]) -> PathLengths:
        """From what threads have counted in whole parts of a metre; their sum is exact."""
        from flight.kernels.near_ground import PER_METRE

        total = np.sum(counted, axis=0) if counted else np.zeros(near.grid.shape, dtype=np.int64)
        return cls(near, total / PER_METRE)


def fields_of(result: FlightResult) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What one flight adds to the densities, by cell of azimuth and distance, up to the farthest that holds anything.

    Returns
    -------
    landings, tracks : (turns, r) float64
        Hazardous fragments that landed in a cell; and lengths of hazardous paths below a person's height over that
        height (of no height: 1 / sin of the angle of impact, which it goes over to).

    Raises
    ------
    InputError
        The flight did not count near the ground.
    """
    counted = result.near_ground
    if counted is None:
        raise InputError("hazard: the flight was not asked to count paths near the ground (near_ground)")
    grid, criteria = counted.near.grid, counted.near.criteria
    rows = result.landing
    dangerous = (rows["status"] == Status.LANDED) & (rows["energy"] >= criteria.energy)
    place = rows["distance"][dangerous]
    if len(place):
        grid = grid.up_to(max(grid.reach, float(place.max()) + grid.cell))
    turn, cell = grid.cells_of(rows["azimuth"][dangerous], place)
    flat, size = turn * grid.shape[1] + cell, grid.shape[0] * grid.shape[1]
    landings = np.bincount(flat, minlength=size).astype(np.float64).reshape(grid.shape)
    tracks = np.zeros(grid.shape)
    if criteria.person_height > 0.0:
        tracks[:, : counted.lengths.shape[1]] = counted.lengths / criteria.person_height
    else:
        steepness = np.sin(np.maximum(np.radians(rows["angle"][dangerous]), SHALLOWEST))
        tracks += np.bincount(flat, weights=1.0 / steepness, minlength=size).reshape(grid.shape)
    held = np.flatnonzero(landings.any(axis=0) | tracks.any(axis=0))
    end = int(held[-1]) + 1 if held.size else 1
    return landings[:, :end], tracks[:, :end]
