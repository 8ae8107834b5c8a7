"""Cutting cells into boxes, one for each of the pieces that share them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numba import njit

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["part"]


@njit(cache=True, nogil=True)
def part(
    ends: NDArray[np.int64],
    order: NDArray[np.int64],
    mass: NDArray[np.float64],
    point: NDArray[np.float64],
    sides: NDArray[np.float64],
    centre: NDArray[np.float64],
) -> None:
    """Cut every cell into boxes whose volumes go by the masses of its pieces; the boxes fill the reference cell.

    A box is cut across its longest side. Its pieces go to the two sides of the cut by the random points along it,
    half of the mass to each as nearly as can be.

    Parameters
    ----------
    ends : (m + 1,) int64
        Pieces `order[ends[c]]` to `order[ends[c + 1]]` are those of cell c.
    order : (p,) int64
        Pieces by cell; within a cell sorted here.
    mass : (p,) float64
        Masses of the pieces (kg), above 0.
    point : (p, 3) float64
        Random point of every piece, which settles on which side of others it lies.
    sides : (m, 3) float64
        Lengths of the cells along their three coordinates (m).
    centre : (p, 3) float64
        Written: centres of the boxes, coordinates 0 to 1 of the reference cell.
    """
    longest = 0
    for cell in range(ends.size - 1):
        longest = max(longest, ends[cell + 1] - ends[cell])
    first, last = np.empty(longest, dtype=np.int64), np.empty(longest, dtype=np.int64)
    low, high = np.empty((longest, 3)), np.empty((longest, 3))
    for cell in range(ends.size - 1):
        if ends[cell] == ends[cell + 1]:
            continue
        first[0], last[0] = ends[cell], ends[cell + 1]
        low[0], high[0] = 0.0, 1.0
        waiting = 1
        while waiting > 0:
            top = waiting - 1
            begin, end = first[top], last[top]
            if end - begin == 1:
                centre[order[begin]] = 0.5 * (low[top] + high[top])
                waiting -= 1
                continue
            axis = np.argmax((high[top] - low[top]) * sides[cell])
            mine = order[begin:end].copy()
            mine = mine[np.argsort(point[mine, axis])]
            order[begin:end] = mine
            total = mass[mine].sum()
            below, cut = mass[mine[0]], 1
            while cut < mine.size - 1 and abs(below + mass[mine[cut]] - 0.5 * total) < abs(below - 0.5 * total):
                below += mass[mine[cut]]
                cut += 1
            plane = low[top, axis] + min(below / total, 1.0) * (high[top, axis] - low[top, axis])
            low[top + 1], high[top + 1] = low[top], high[top]
            high[top, axis], low[top + 1, axis] = plane, plane
            last[top], first[top + 1], last[top + 1] = begin + cut, begin + cut, end
            waiting += 1
