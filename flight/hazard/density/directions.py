"""Directions in which hazard distances are estimated, and the smoothing of densities over azimuth and distance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import require_number

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.fluence import PolarGrid

    Array = NDArray[np.float64]


KERNEL = 10.0
"""Half-width of the azimuth kernel (degrees): narrower than the jets between neighbouring rounds."""
RADIAL = 0.04  # h: standard deviation of the radial kernel in ln r
_TOGETHER = 32  # positions whose densities are computed from the cells that matter to them
SPACING = 0.02  # in ln r, of the positions at which the density is computed; between them it is a power of r
_COSINE_MOMENT = 1.0 / 3.0 - 2.0 / math.pi**2  # second moment of the raised cosine over its half-width squared


@dataclass(frozen=True, eq=False)
class Directions:
    """Directions in which distances are estimated, and how the cells of azimuth weigh in each.

    Attributes
    ----------
    grid : PolarGrid
        Cells of azimuth and distance.
    basis : "all_azimuths" or "worst_direction"
        Whether all azimuths are one direction.
    kernel : float
        Half-width of the azimuth kernel (degrees).
    mirrors : tuple of float
        Azimuths of the mirror planes that were used (degrees).
    """

    grid: PolarGrid
    basis: str = "all_azimuths"
    kernel: float = KERNEL
    mirrors: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a kernel that is not numeric."""
        require_number("hazard", "kernel", self.kernel, "degrees")

    @property
    def axisymmetric(self) -> bool:
        """Whether all azimuths are one direction."""
        return self.basis == "all_azimuths"

    @cached_property
    def _classes(self) -> tuple[NDArray[np.int64], ...]:
        return self.grid.classes(self.mirrors, axisymmetric=self.axisymmetric)

    @property
    def number(self) -> int:
        """Number of classes of directions."""
        return int(self._classes[1].max()) + 1

    @cached_property
    def azimuth(self) -> Array:
        """Azimuth of the first direction of each class (d,) in degrees."""
        first = np.unique(self._classes[1], return_index=True)[1]
        return np.asarray(first * self.grid.width)

    @property
    def of_every(self) -> NDArray[np.int64]:
        """Class of every direction 0, `grid.width`, ... (a,)."""
        return self._classes[1]

    def folded(self, fields: Array) -> Array:
        """Sums of fields (..., a, r) over the classes of cells: (..., c, r)."""
        cells = self._classes[0]
        order = np.argsort(cells, kind="stable")
        starts = np.searchsorted(cells[order], np.arange(cells.max() + 1))
        return np.asarray(np.add.reduceat(fields[..., order, :], starts, axis=-2))

    def unfolded(self, sums: Array) -> Array:
        """Numbers by azimuth cell (..., a) from those of the classes (..., c)."""
        return np.asarray(sums @ self._spread.T)

    def weights(self, passed: Array | None = None) -> Array:
        """Number per azimuth cell in each direction from the classes' sums (d, c).

        `passed` (a // 2 + 1,): what is kept of every Fourier component of the azimuth; None: all of them.
        """
        if self.axisymmetric:
            return np.full((1, 1), 1.0 / self.grid.azimuth_cells)
        share = self._share
        if passed is not None:
            share = np.fft.irfft(np.fft.rfft(share, axis=1) * passed, share.shape[1], axis=1)
        return np.asarray(share @ self._spread)

    @cached_property
    def _spread(self) -> Array:
        """Number in every azimuth cell from those of the classes (a, c)."""
        cells = self._classes[0]
        size = np.bincount(cells)
        spread = np.zeros((self.grid.azimuth_cells, len(size)))
        spread[np.arange(self.grid.azimuth_cells), cells] = 1.0 / size[cells]
        return spread

    @cached_property
    def _share(self) -> Array:
        """Kernel of every direction over the azimuth cells (d, a)."""
        edges = self.grid.start + self.grid.width * np.arange(self.grid.azimuth_cells + 1)
        gap = edges - self.azimuth[:, None]
        share = np.zeros((len(self.azimuth), self.grid.azimuth_cells))
        # The cells smooth too: with a kernel narrower by that, the second moment is that of the kernel asked for.
        half = math.sqrt(max(self.kernel**2 - self.grid.width**2 / (12.0 * _COSINE_MOMENT), 0.25 * self.kernel**2))
        for turn in (-720.0, -360.0, 0.0, 360.0, 720.0):  # the kernel may reach around
            share += np.diff(_raised_cosine(gap + turn, half), axis=1)
        return share

    @property
    def radial(self) -> RadialSmoothing:
        """Smoothing over distance."""
        grid = self.grid
        return _radial(grid.sectors, grid.cuts, grid.cell, grid.cells)


@lru_cache(maxsize=4)
def _radial(*grid: Any) -> RadialSmoothing:
    from flight.fluence import PolarGrid

    return RadialSmoothing(PolarGrid(*grid))


class RadialSmoothing:
    """Places in ln r, and what smooths numbers by distance cell to numbers per ln r there.

    Attributes
    ----------
    positions : (j,) float64
        Logarithms of distances in m.
    smooth, slope : (r, j) float64
        Smoothed number per ln r and its derivative, of one fragment in a cell, spread evenly in ln r over it.
    area : (j,) float64
        Ground of an azimuth cell per ln r (m2).
    """

    def __init__(self, grid: PolarGrid) -> None:
        edges = np.log(np.maximum(grid.edges, grid.edges[1] / math.e))
        count = math.ceil((edges[-1] - edges[0] + 4.0 * RADIAL) / SPACING) + 1
        self.places = edges[0] + SPACING * np.arange(count)
        gap = (edges[:, None] - self.places) / RADIAL
        width = np.diff(edges)[:, None]
        self.smooth = np.diff(0.5 * _erf(gap / math.sqrt(2.0)), axis=0) / width
        self.slope = -np.diff(np.exp(-0.5 * gap**2), axis=0) / (width * RADIAL * math.sqrt(2.0 * math.pi))
        self.area = (2.0 * math.pi / grid.azimuth_cells) * np.exp(2.0 * self.places)

    def smoothed(self, number: Array, last: int) -> tuple[Array, Array]:
        """Number per ln r and its derivative at the first places (..., last) from numbers by cell (..., r)."""
        found = np.zeros((2, *number.shape[:-1], last))
        for begin in range(0, last, _TOGETHER):
            here = slice(begin, min(begin + _TOGETHER, last))
            cells = held(self.smooth[: number.shape[-1], here].any(axis=1))
            for values, kernel in zip(found, (self.smooth, self.slope), strict=True):
                values[..., here] = np.tensordot(number[..., cells], kernel[cells, here], 1)
        return found[0], found[1]


def held(used: NDArray[np.bool_]) -> slice:
    """From the first to the last that is used."""
    places = np.flatnonzero(used)
    return slice(int(places[0]), int(places[-1]) + 1) if places.size else slice(0)


def _raised_cosine(gap: Array, half: float) -> Array:
    """Integral of the raised cosine of unit area from far below to a gap (degrees)."""
    x = np.clip(gap / half, -1.0, 1.0)
    return np.asarray(0.5 * (1.0 + x + np.sin(math.pi * x) / math.pi))


_erf = np.vectorize(math.erf, otypes=[np.float64])
