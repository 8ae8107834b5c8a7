"""Cell lists of swept boxes: pairs of fragments that may collide within a window of time.

A fragment stands in every cell that the box about its path touches, so a fast or a large one is found from all of
them. A pair shares several cells; it is looked at in one only, the lowest that both touch. Cells are kept in buckets by
a hash of their place, so a cloud of any extent takes memory in proportion to its fragments.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel, kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Whole = NDArray[np.int64]

__all__ = ["bucket_of", "cells_of", "fill_cells", "home"]


@inner_kernel()
def bucket_of(x: int, y: int, z: int, buckets: int) -> int:
    """Bucket of a cell, by a hash of its block of 4 x 4 x 4 cells (Teschner et al. 2003); `buckets` is a power of two.

    The cells of a block have buckets side by side, so the neighbours of a fragment are near it in memory.
    """
    block = ((x >> 2) * 73856093) ^ ((y >> 2) * 19349663) ^ ((z >> 2) * 83492791)
    return ((block << 6) | ((x & 3) << 4) | ((y & 3) << 2) | (z & 3)) & (buckets - 1)


@inner_kernel()
def cells_of(box: Array, size: float, cells: Whole) -> int:
    """Lowest and highest cell (6,) that a box (low, high) touches; returns how many it touches."""
    count = 1
    for axis in range(3):
        cells[axis] = np.int64(math.floor(box[axis] / size))
        cells[3 + axis] = np.int64(math.floor(box[3 + axis] / size))
        count *= cells[3 + axis] - cells[axis] + 1
    return count


@inner_kernel()
def home(first: Whole, second: Whole, x: int, y: int, z: int) -> bool:
    """Whether this cell is the lowest that both of two ranges of cells (6,) touch: there the pair is tested."""
    return (
        x == max(first[0], second[0])
        and y == max(first[1], second[1])
        and z == max(first[2], second[2])
        and x <= min(first[3], second[3])
        and y <= min(first[4], second[4])
        and z <= min(first[5], second[5])
    )


@kernel
def fill_cells(active: Whole, boxes: Array, size: float, cells: Whole) -> tuple[Whole, Whole, Whole]:
    """Sort the active fragments into the cells that their boxes touch.

    Parameters
    ----------
    active : (m,) numbers of the fragments that take part.
    boxes : (n, 6) lowest and highest corner of what each sweeps (m).
    size : length of a cell (m); infinite: one cell for all.
    cells : (n, 6) filled with the lowest and highest cell of each.

    Returns
    -------
    starts : (buckets + 1,) first entry of each bucket.
    member : (entries,) fragment of each entry; in a bucket in the order of `active`.
    place : (entries, 3) cell of each entry, since buckets may hold several.
    """
    entries = 0
    for i in active:
        entries += cells_of(boxes[i], size, cells[i])
    buckets = 1
    while buckets < entries:
        buckets *= 2
    starts = np.zeros(buckets + 1, np.int64)
    for i in active:
        c = cells[i]
        for x in range(c[0], c[3] + 1):
            for y in range(c[1], c[4] + 1):
                for z in range(c[2], c[5] + 1):
                    starts[bucket_of(x, y, z, buckets) + 1] += 1
    for b in range(buckets):
        starts[b + 1] += starts[b]
    following = starts[:-1].copy()
    member, place = np.empty(entries, np.int64), np.empty((entries, 3), np.int64)
    for i in active:
        c = cells[i]
        for x in range(c[0], c[3] + 1):
            for y in range(c[1], c[4] + 1):
                for z in range(c[2], c[5] + 1):
                    b = bucket_of(x, y, z, buckets)
                    entry = following[b]
                    following[b] += 1
                    member[entry] = i
                    place[entry, 0], place[entry, 1], place[entry, 2] = x, y, z
    return starts, member, place
