"""Surfaces of cuts through clouds of points: planes, spheres and half planes from an axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["choose_cut", "key"]

_SAMPLE = 64  # rows at least that settle the direction of a cut
_SLICE = 0.25  # share of the mass below which a part is taken from around a place, not cut off by a plane
_BINS = 48  # of the angle, in which the gap of an arc is looked for
_HOLLOW = 0.1  # square of the least distance from the middle over the mean square, from which a region is hollow


@njit(cache=True, nogil=True)
def key(row: NDArray[np.float64], i: int, q: NDArray[np.float64]) -> float:
    """By what a cut orders the rows: a height, a distance, or an angle about an axis (`q[4]` is 1)."""
    x, y, z = row[i, 0], row[i, 1], row[i, 2]
    if q[4] == 0.0:
        return q[0] * x + q[1] * y + q[2] * z + q[3] * (x * x + y * y + z * z)
    along = q[0] * x + q[1] * y + q[2] * z + q[3]
    across = q[5] * x + q[6] * y + q[7] * z + q[8]
    part = across / (abs(along) + abs(across) + 1e-300)  # rises with the angle, as an arc tangent does
    return (part if part >= 0.0 else 4.0 + part) if along >= 0.0 else 2.0 - part


@njit(cache=True, nogil=True)
def _direction(
    row: NDArray[np.float64], begin: int, end: int, normal: NDArray[np.float64], mean: NDArray[np.float64]
) -> tuple[float, float, float]:
    """Random unit vector, most likely along the longest extent of the rows; writes their mean place."""
    step = max(1, (end - begin) // _SAMPLE)
    number = 0
    mean[:] = 0.0
    for i in range(begin, end, step):
        for k in range(3):
            mean[k] += row[i, k]
        number += 1
    mean /= number
    xx = yy = zz = xy = xz = yz = 0.0
    for i in range(begin, end, step):
        x, y, z = row[i, 0] - mean[0], row[i, 1] - mean[1], row[i, 2] - mean[2]
        xx += x * x
        yy += y * y
        zz += z * z
        xy += x * y
        xz += x * z
        yz += y * z
    a, b, c = normal[0], normal[1], normal[2]
    for _ in range(2):
        x = xx * a + xy * b + xz * c
        y = xy * a + yy * b + yz * c
        z = xz * a + yz * b + zz * c
        length = np.sqrt(x * x + y * y + z * z)
        if length > 0.0:
            a, b, c = x / length, y / length, z / length
    length = np.sqrt(a * a + b * b + c * c)
    return a / length, b / length, c / length


@njit(cache=True, nogil=True)
def _angular(
    row: NDArray[np.float64],
    begin: int,
    end: int,
    normal: NDArray[np.float64],
    uniform: float,
    centre: NDArray[np.float64],
    axis: NDArray[np.float64],
    q: NDArray[np.float64],
) -> None:
    """Order by the angle about the axis through `centre`, from the gap of an arc, or from anywhere in a ring."""
    smallest = 0
    for k in range(3):
        if abs(axis[k]) < abs(axis[smallest]):
            smallest = k
    one = np.zeros(3)
    one[smallest] = 1.0
    one = one - axis * (axis @ one) / (axis @ axis)
    one /= np.sqrt(one @ one)
    two = np.array([axis[1] * one[2] - axis[2] * one[1], axis[2] * one[0] - axis[0] * one[2],
                    axis[0] * one[1] - axis[1] * one[0]]) / np.sqrt(axis @ axis)  # fmt: skip
    bins = np.zeros(_BINS, dtype=np.int64)
    for i in range(begin, end, max(1, (end - begin) // (8 * _SAMPLE))):
        x, y, z = row[i, 0] - centre[0], row[i, 1] - centre[1], row[i, 2] - centre[2]
        angle = np.arctan2(x * two[0] + y * two[1] + z * two[2], x * one[0] + y * one[1] + z * one[2])
        bins[int((angle / (2.0 * np.pi) + 0.5) * _BINS) % _BINS] += 1
    longest, last, run = 0, 0, 0
    for k in range(2 * _BINS):
        run = run + 1 if bins[k % _BINS] == 0 else 0
        if run > longest and run <= _BINS:
            longest, last = run, k
    share = (last + 1 - 0.5 * longest) / _BINS if longest > 1 else uniform
    start = 2.0 * np.pi * (share - 0.5)
    sense = 1.0 if normal[0] > 0.0 else -1.0
    q[3] = q[8] = 0.0
    for k in range(3):
        q[k] = np.cos(start) * one[k] + np.sin(start) * two[k]
        q[5 + k] = sense * (np.cos(start) * two[k] - np.sin(start) * one[k])
        q[3] -= q[k] * centre[k]
        q[8] -= q[5 + k] * centre[k]
    q[4] = 1.0


@njit(cache=True, nogil=True)
def choose_cut(
    row: NDArray[np.float64],
    begin: int,
    end: int,
    share: float,
    normal: NDArray[np.float64],
    uniform: float,
    centre: NDArray[np.float64],
    axis: NDArray[np.float64],
    mean: NDArray[np.float64],
    q: NDArray[np.float64],
) -> None:
    """Choose the surface of a cut.

    A plane across the longest extent; a sphere about an end for a part so light that a slice would be thin; a half
    plane from the axis for a ring or a long arc, of which a plane would cut off two ends at once.
    """
    a, b, c = _direction(row, begin, end, normal, mean)
    step = max(1, (end - begin) // _SAMPLE)
    nearest, spread, number = np.inf, 0.0, 0
    far = -np.inf
    for i in range(begin, end, step):
        x, y, z = row[i, 0] - mean[0], row[i, 1] - mean[1], row[i, 2] - mean[2]
        square = x * x + y * y + z * z
        nearest, spread, number = min(nearest, square), spread + square, number + 1
        far = max(far, a * x + b * y + c * z)
    q[:] = 0.0
    if nearest * number > _HOLLOW * spread and (axis[0] != 0.0 or axis[1] != 0.0 or axis[2] != 0.0):
        _angular(row, begin, end, normal, uniform, centre, axis, q)
    elif share < _SLICE:
        i = begin + int(uniform * (end - begin))
        out = max(far - (a * (row[i, 0] - mean[0]) + b * (row[i, 1] - mean[1]) + c * (row[i, 2] - mean[2])), 0.0)
        q[0] = -2.0 * (row[i, 0] + out * a)
        q[1] = -2.0 * (row[i, 1] + out * b)
        q[2] = -2.0 * (row[i, 2] + out * c)
        q[3] = 1.0
    else:
        q[0], q[1], q[2] = -a, -b, -c
