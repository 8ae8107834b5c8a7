"""Jittered points in trilinear hexahedra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["moments", "sample_cells", "turn_rigidly"]

_STEP = (0.8191725133961645, 0.6710436067037893, 0.5497004779019703)  # 1/g, 1/g2, 1/g3 with g^4 = g + 1
_FUNCTIONS = 6
# Reflections by how many points share one place: a pair, the even sign changes, or all eight.
_SIGNS = np.array(
    [
        [[1, 1, 1], [-1, -1, -1], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]],
        [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1], [0, 0, 0], [0, 0, 0], [0, 0, 0], [0, 0, 0]],
        [[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1], [-1, -1, -1], [-1, 1, 1], [1, -1, 1], [1, 1, -1]],
    ],
    dtype=np.float64,
)


@njit(cache=True, nogil=True)
def sample_cells(
    modes: NDArray[np.float64],
    offset: NDArray[np.int64],
    cell_mass: NDArray[np.float64],
    label: NDArray[np.int64],
    shift: NDArray[np.float64],
    values: NDArray[np.float64],
    mass: NDArray[np.float64],
    owner: NDArray[np.int64],
    local: NDArray[np.float64],
) -> None:
    """Values of trilinear functions at random points of every cell, with each cell's mean kept.

    Points come as reflections of one random place: two (through the centre), four (even sign changes) or eight (all
    sign changes). Further places of a cell follow the additive recurrence of R. Roberts (2018), which fills the cell
    evenly. Eight reflections give every mode its mean of zero; with two or four a part of the bilinear and trilinear
    modes remains, and is taken from all points of the cell alike.

    Parameters
    ----------
    modes : (m, 8, 6) float64
        Coefficients of six functions: position and velocity (`shape_functions.modes`).
    offset : (m + 1,) int64
        Points `offset[c]` to `offset[c + 1]` lie in cell c: 2, 4, or a multiple of 8.
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
    local : (p, 3) float64
        Written: coordinates 0 to 1 of the points in their cells; an array without rows is left alone.
    """
    term = np.empty((8, _FUNCTIONS))
    mean = np.empty(_FUNCTIONS)
    for cell in range(offset.size - 1):
        begin, number = offset[cell], offset[cell + 1] - offset[cell]
        kind, group = (2, 8) if number >= 8 else (1, 4) if number == 4 else (0, 2)
        share = cell_mass[cell] / number
        for first in range(0, number, group):
            index = first // group
            u = (shift[cell, 0] + index * _STEP[0]) % 1.0
            v = (shift[cell, 1] + index * _STEP[1]) % 1.0
            w = (shift[cell, 2] + index * _STEP[2]) % 1.0
            if group < 8:  # the reflections do not reach every octant: the place itself must
                u, v, w = 2.0 * u - 1.0, 2.0 * v - 1.0, 2.0 * w - 1.0
            for j in range(_FUNCTIONS):
                term[0, j] = modes[cell, 0, j]
                term[1, j] = modes[cell, 1, j] * u
                term[2, j] = modes[cell, 2, j] * v
                term[3, j] = modes[cell, 3, j] * w
                term[4, j] = modes[cell, 4, j] * u * v
                term[5, j] = modes[cell, 5, j] * u * w
                term[6, j] = modes[cell, 6, j] * v * w
                term[7, j] = modes[cell, 7, j] * u * v * w
            for image in range(group):
                x, y, z = _SIGNS[kind, image, 0], _SIGNS[kind, image, 1], _SIGNS[kind, image, 2]
                point = begin + first + image
                mass[point], owner[point] = share, label[cell]
                for j in range(_FUNCTIONS):
                    values[point, j] = (
                        term[0, j]
                        + x * (term[1, j] + y * (term[4, j] + z * term[7, j]) + z * term[5, j])
                        + y * (term[2, j] + z * term[6, j])
                        + z * term[3, j]
                    )
                if local.shape[0] > 0:
                    local[point, 0] = 0.5 + 0.5 * x * u
                    local[point, 1] = 0.5 + 0.5 * y * v
                    local[point, 2] = 0.5 + 0.5 * z * w
        if group == 8:
            continue
        mean[:] = 0.0
        for point in range(begin, begin + number):
            for j in range(_FUNCTIONS):
                mean[j] += values[point, j]
        for j in range(_FUNCTIONS):
            mean[j] = mean[j] / number - modes[cell, 0, j]
        for point in range(begin, begin + number):
            for j in range(_FUNCTIONS):
                values[point, j] -= mean[j]


@njit(cache=True, nogil=True)
def moments(
    mass: NDArray[np.float64], values: NDArray[np.float64], centre: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Inertia tensor (3, 3) in kg m2 and angular momentum (3,) in kg m2/s of points about `centre` (m).

    `values` (p, 6) holds positions (m) and velocities (m/s) of the points with masses `mass` (p,) (kg).
    """
    xx = yy = zz = xy = xz = yz = 0.0
    a = b = c = 0.0
    for i in range(mass.size):
        x, y, z = values[i, 0] - centre[0], values[i, 1] - centre[1], values[i, 2] - centre[2]
        u, v, w = values[i, 3], values[i, 4], values[i, 5]
        m = mass[i]
        xx += m * x * x
        yy += m * y * y
        zz += m * z * z
        xy += m * x * y
        xz += m * x * z
        yz += m * y * z
        a += m * (y * w - z * v)
        b += m * (z * u - x * w)
        c += m * (x * v - y * u)
    inertia = np.array([[yy + zz, -xy, -xz], [-xy, xx + zz, -yz], [-xz, -yz, xx + yy]])
    return inertia, np.array([a, b, c])


@njit(cache=True, nogil=True)
def turn_rigidly(values: NDArray[np.float64], centre: NDArray[np.float64], rate: NDArray[np.float64]) -> None:
    """Add the velocity of a rigid rotation (1/s) about `centre` (m) to the points `values` (p, 6), in place."""
    for i in range(values.shape[0]):
        x, y, z = values[i, 0] - centre[0], values[i, 1] - centre[1], values[i, 2] - centre[2]
        values[i, 3] += rate[1] * z - rate[2] * y
        values[i, 4] += rate[2] * x - rate[0] * z
        values[i, 5] += rate[0] * y - rate[1] * x
