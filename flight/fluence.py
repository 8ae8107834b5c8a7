"""Lengths of the paths of hazardous fragments below a person's height (their fluence), by azimuth and distance.

Cells of azimuth and distance lie about the origin. The distance cells of the tables (`cell` wide) are cut into finer
ones, of at most 2 % of their distance or a tenth of a cell, whichever is wider; the sectors of the tables are cut so
that the azimuth kernel covers eight cells or more. Cells of the tables are whole numbers of these.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.arguments import real_array, require_number, require_numbers

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from flight.kernels.fluence import FluenceCells


SHORTEST = 0.2  # of a distance cell: a piece of a path, where a tenth of its distance is less
FINEST = 0.1  # of a distance cell of the tables
RELATIVE = 0.02  # width of a cell over its distance
PER_KERNEL = 4  # azimuth cells in half a kernel
REACH = 2000.0  # m, of a first grid: a flight extends it where fragments pass beyond


@dataclass(frozen=True, eq=False)
class PolarGrid:
    """A grid of `sectors * cuts` cells of azimuth and of distance cells up to `reach`.

    Attributes
    ----------
    sectors : int
        Sectors of the tables; the first is centred on azimuth 0.
    cuts : int
        Azimuth cells of a sector.
    cell : float
        Width of the distance cells of the tables (m).
    cells : int
        Number of those.
    """

    sectors: int = 72
    cuts: int = 2
    cell: float = 10.0
    cells: int = 60

    def __post_init__(self) -> None:
        require_number("hazard", "distance_cell", self.cell, "m", above=0.0)
        require_numbers("hazard", self, {"sectors": "", "cuts": "", "cells": ""}, low=1.0)

    @classmethod
    def of(cls, sectors: int = 72, kernel: float = 10.0, cell: float = 10.0, reach: float = REACH) -> PolarGrid:
        """A grid for a kernel of this half-width (degrees), up to a distance of at least `reach` (m)."""
        given = {"sectors": (sectors, ""), "kernel": (kernel, "degrees"), "cell": (cell, "m"), "reach": (reach, "m")}
        for name, (value, unit) in given.items():
            require_number("hazard", name, value, unit)
        cuts = max(1, math.ceil(360.0 / sectors / (kernel / PER_KERNEL) - 1e-9))
        if sectors * cuts % 2:
            cuts *= 2  # so that both ends of a diameter lie alike
        return cls(sectors, cuts, cell, max(1, math.ceil(reach / cell - 1e-9)))

    def up_to(self, reach: float) -> PolarGrid:
        """The same cells up to another distance (m)."""
        return PolarGrid(self.sectors, self.cuts, self.cell, max(1, math.ceil(reach / self.cell - 1e-9)))

    def holding(self, cells: int) -> PolarGrid:
        """The same cells, as few of the tables as hold so many fine ones; beyond this grid's reach if need be."""
        missing = max(0, cells - int(self.first[-1]))
        longer = self.up_to(self.cell * (self.cells + missing))  # a cell of the tables has one fine cell or more
        return longer.up_to(longer.cell * max(1, int(np.searchsorted(longer.first, cells))))

    @property
    def azimuth_cells(self) -> int:
        """Number of azimuth cells."""
        return self.sectors * self.cuts

    @property
    def width(self) -> float:
        """Width of an azimuth cell (degrees)."""
        return 360.0 / self.azimuth_cells

    @property
    def start(self) -> float:
        """Azimuth at which the first cell begins (degrees)."""
        return -180.0 / self.sectors

    @property
    def reach(self) -> float:
        """Farthest distance (m)."""
        return self.cell * self.cells

    @cached_property
    def parts(self) -> NDArray[np.int64]:
        """Fine cells of every distance cell of the tables (cells,)."""
        inner = self.cell * np.maximum(np.arange(self.cells), 1)
        width = np.maximum(RELATIVE * inner, FINEST * self.cell)
        return np.maximum(1, np.ceil(self.cell / width - 1e-9)).astype(np.int64)

    @cached_property
    def first(self) -> NDArray[np.int64]:
        """First fine cell of every distance cell of the tables, and their number (cells + 1,)."""
        return np.concatenate([[0], np.cumsum(self.parts)])

    @cached_property
    def edges(self) -> NDArray[np.float64]:
        """Edges of the fine distance cells (r + 1,) in m."""
        number = np.repeat(np.arange(self.cells), self.parts)
        within = np.arange(1, len(number) + 1) - self.first[number]
        return np.concatenate([[0.0], self.cell * (number + within / self.parts[number])])

    @property
    def shape(self) -> tuple[int, int]:
        """Cells of azimuth and of distance."""
        return self.azimuth_cells, int(self.first[-1])

    @cached_property
    def area(self) -> NDArray[np.float64]:
        """Ground of one azimuth cell in every distance cell (r,) in m2."""
        return np.asarray(math.pi / self.azimuth_cells * np.diff(self.edges**2))

    def cells_of(self, azimuth: ArrayLike, distance: ArrayLike) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Azimuth cells of azimuths (degrees), and fine distance cells of distances (m); beyond the grid: -1."""
        turn = np.floor((np.asarray(azimuth, dtype=np.float64) - self.start) / self.width).astype(np.int64)
        turn %= self.azimuth_cells
        distances = np.asarray(distance, dtype=np.float64)
        found = np.searchsorted(self.edges, distances, side="right") - 1
        return turn, np.where(distances < self.edges[-1], found, -1)

    def maps(self, mirror: float) -> bool:
        """Whether the mirror plane at this azimuth (degrees) maps cells on cells."""
        return abs(_shift(2.0 * mirror, self.width) * self.width - 2.0 * mirror) < 1e-6

    def classes(self, mirrors: Sequence[float] = (), *, axisymmetric: bool = False) -> tuple[NDArray[np.int64], ...]:
        """Which azimuth cells, and which directions, are the same by symmetry.

        Parameters
        ----------
        mirrors : sequence of float
            Azimuths of vertical mirror planes through the origin (degrees); one that does not map cells on cells is
            left out.
        axisymmetric : bool
            All azimuths are alike.

        Returns
        -------
        cells, directions : (a,) int64
            Number of the class of every azimuth cell, and of every direction 0, `width`, 2 `width`, ...
        """
        number = np.arange(self.azimuth_cells)
        if axisymmetric:
            return np.zeros_like(number), np.zeros_like(number)
        offset = _shift(2.0 * self.start, self.width)
        shifts = [_shift(2.0 * mirror, self.width) for mirror in mirrors if self.maps(mirror)]
        return (
            _classes([(shift - offset - 1 - number) % self.azimuth_cells for shift in shifts], self.azimuth_cells),
            _classes([(shift - number) % self.azimuth_cells for shift in shifts], self.azimuth_cells),
        )


def _shift(angle: float, width: float) -> int:
    return round(angle / width)


def _classes(images: Sequence[NDArray[np.int64]], number: int) -> NDArray[np.int64]:
    """Numbers of the classes of 0..number-1 under the group that permutations generate."""
    lowest = np.arange(number)
    for _ in range(number):
        before = lowest.copy()
        for image in images:
            lowest = np.minimum(lowest, lowest[image])
        if np.array_equal(before, lowest):
            break
    return np.unique(lowest, return_inverse=True)[1]


@dataclass(frozen=True, eq=False)
class FluenceGrid:
    """What `flight.fly` counts along the paths: their lengths below a person's height above the ground.

    A fragment counts where its kinetic energy there is `energy` or more. After a ricochet its path counts on, apart
    from what came before its first impact on the ground.
    """

    grid: PolarGrid
    """Cells; where fragments pass farther than its reach, `fly` extends it."""
    energy: float = 79.0
    """Of a hazardous fragment (J)."""
    height: float = 1.8
    """Of a person above the ground (m)."""

    def table(self) -> FluenceCells:
        """For the kernels."""
        from flight.kernels.fluence import FluenceCells

        grid = self.grid
        return FluenceCells(
            float(self.height), float(self.energy), float(grid.cell),
            1.0 / float(grid.cell), SHORTEST * float(grid.cell), grid.parts, grid.cell / grid.parts, grid.first,
            math.radians(grid.start), 1.0 / math.radians(grid.width),
        )  # fmt: skip


class Weights(NamedTuple):
    """Of fragments that stand for others in what is counted near the ground."""

    number: NDArray[np.float64]
    """(n,) float64: fragments that each stands for."""
    slopes: NDArray[np.float64]
    """(n, b) float64: slopes of the facets at its first b impacts over the surface's roughness; others are drawn."""

    def check(self, fragments: int) -> None:
        """Refuse what does not fit to so many fragments."""
        real_array("weights", "number", self.number, "", (fragments,))
        real_array("weights", "slopes", self.slopes, "", (fragments, *np.shape(self.slopes)[1:]))


@dataclass(frozen=True, eq=False, repr=False)
class Fluence:
    """Lengths of the paths of hazardous fragments below a person's height."""

    cells: FluenceGrid
    """What was counted; its grid reaches as far as needed."""
    before: NDArray[np.float64]
    after: NDArray[np.float64]
    """(a, r) float64: of all fragments by cell of the grid (m): before their first impact on the ground, and after
    it."""
    weights: NDArray[np.float64] | None = None
    """(n,) float64: fragments that each of those flown stands for; None: one."""

    def __repr__(self) -> str:
        azimuths, distances = self.lengths.shape
        return f"<flight.Fluence: {self.lengths.sum():.4g} m in {azimuths} x {distances} cells>"

    @property
    def lengths(self) -> NDArray[np.float64]:
        """Of whole paths, (a, r) in m."""
        return self.before + self.after

    @classmethod
    def of(
        cls, cells: FluenceGrid, counted: list[NDArray[np.int64]], weights: NDArray[np.float64] | None = None
    ) -> Fluence:
        """From what threads have counted in whole parts of a metre; their sum is exact."""
        from flight.kernels.fluence import PER_METRE

        total = np.sum(counted, axis=0) if counted else np.zeros((2, *cells.grid.shape), dtype=np.int64)
        before, after = total / PER_METRE
        return cls(cells, before, after, weights)
