"""Paths of hazardous fragments below a person's height: what is counted, and where."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.hazard.criteria import Criteria
    from flight.hazard.density.polar_grid import PolarGrid
    from flight.kernels import near_ground

SHORTEST = 0.2  # of a distance cell: a piece of a path, where a tenth of its distance is less

__all__ = ["NearGround", "PathLengths"]


@dataclass(frozen=True, eq=False)
class NearGround:
    """What `flight.fly` counts along the paths: their lengths below a person's height above the ground.

    A fragment counts where its kinetic energy there is that of `criteria.energy` or more. After a ricochet its
    path counts on, apart from what came before its first impact on the ground.

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
    before, after : (turns, r) float64
        Of all fragments by cell of the grid (m): before their first impact on the ground, and after it.
    """

    near: NearGround
    before: NDArray[np.float64]
    after: NDArray[np.float64]

    def __repr__(self) -> str:
        turns, cells = self.lengths.shape
        return f"<flight.PathLengths: {self.lengths.sum():.4g} m in {turns} x {cells} cells>"

    @property
    def lengths(self) -> NDArray[np.float64]:
        """Of whole paths, (turns, r) in m."""
        return self.before + self.after

    @classmethod
    def of(cls, near: NearGround, counted: list[NDArray[np.int64]]) -> PathLengths:
        """From what threads have counted in whole parts of a metre; their sum is exact."""
        from flight.kernels.near_ground import PER_METRE

        total = np.sum(counted, axis=0) if counted else np.zeros((2, *near.grid.shape), dtype=np.int64)
        before, after = total / PER_METRE
        return cls(near, before, after)
