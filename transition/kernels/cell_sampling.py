"""Jittered points in trilinear hexahedra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from transition.kernels.compiling import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["sample_cells"]

_STEP = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)  # 1/g, 1/g2, 1/g3 with g^4 = g + 1
_FUNCTIONS = 6


@kernel
def sample_cells(
    modes: NDArray[np.float64],
    offset: NDArray[np.int64],
    cell_mass: NDArray[np.float64],
    label: NDArray[np.int64],
    shift: NDArray[np.float64],
    values: NDArray[np.float64],
    mass: NDArray[np.float64],
    owner: NDArray[np.int64],
) -> None:
    """Values of trilinear functions at random points of every cell, with each cell's mean kept.

    Points come in pairs, one the reflection of the other through the cell's centre, so that the linear modes have
    the mean of zero. That of the bilinear modes is taken from all points of the cell alike. (Eight reflections at the
    middle planes would leave nothing to take, but they put pairs of neighbours on these planes, and fragments of few
    points show them.) The pairs of a cell follow the additive recurrence of R. Roberts (2018), which fills it evenly.

    Parameters
    ----------
    modes : (m, 8, 6) float64
        Coefficients of six functions: position and velocity (`shape_functions.modes`).
    offset : (m + 1,) int64
        Points `offset[c]` to `offset[c + 1]` lie in cell c: an even number.
    cell_mass : (m,) float64
        Masses of the cells (kg).
    label : (m,) int64
        A number for each cell.
    shift : (m, 3) float64
        Uniform random numbers in [0, 1): the first place of every cell.
    values : (p, 6) float64
        Written: the functions at the points.
    mass, owner : (p,)
        Written: an equal share of the cell's mass (kg) for each of its points, and the cell's number.
    """
    odd, even, mean = np.empty(_FUNCTIONS), np.empty(_FUNCTIONS), np.empty(_FUNCTIONS)
    for cell in range(offset.size - 1):
        begin, number = offset[cell], offset[cell + 1] - offset[cell]
        share = cell_mass[cell] / number
        mean[:] = 0.0
        for pair in range(number // 2):
            u = 2.0 * ((shift[cell, 0] + pair * _STEP[0]) % 1.0) - 1.0
            v = 2.0 * ((shift[cell, 1] + pair * _STEP[1]) % 1.0) - 1.0
            w = 2.0 * ((shift[cell, 2] + pair * _STEP[2]) % 1.0) - 1.0
            one = begin + 2 * pair
            for j in range(_FUNCTIONS):
                odd[j] = modes[cell, 1, j] * u + modes[cell, 2, j] * v + modes[cell, 3, j] * w
                odd[j] += modes[cell, 7, j] * (u * v * w)
                even[j] = modes[cell, 4, j] * (u * v) + modes[cell, 5, j] * (u * w) + modes[cell, 6, j] * (v * w)
                values[one, j] = modes[cell, 0, j] + even[j] + odd[j]
                values[one + 1, j] = modes[cell, 0, j] + even[j] - odd[j]
                mean[j] += even[j]
            mass[one], mass[one + 1] = share, share
            owner[one], owner[one + 1] = label[cell], label[cell]
        for j in range(_FUNCTIONS):
            mean[j] *= 2.0 / number
        for point in range(begin, begin + number):
            for j in range(_FUNCTIONS):
                values[point, j] -= mean[j]
