"""Holes of a map of heights: which nodes belong together, and the height that each hole is given."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

__all__ = ["fill_level"]

_AROUND = [(j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if (j, i) != (0, 0)]


def fill_level(grid: NDArray[np.float64]) -> NDArray[np.bool_] | None:
    """Fill every hole in place, level at the lowest height on its rim, so that it stops no fragment early.

    Parameters
    ----------
    grid : (rows, columns) float64
        Heights (m), not finite in holes; at least one node has a height.

    Returns
    -------
    (rows, columns) bool or None
        Nodes of holes that reach the map's edge: no height is known on their other side. None without such holes.
    """
    missing = ~np.isfinite(grid)
    number = np.full(grid.shape, -1, dtype=np.int64)
    j, i = np.nonzero(missing)
    number[j, i] = np.arange(len(j))
    hole = _components(len(j), list(_links(number, j, i)))
    lowest = np.full(len(j), np.inf)
    for down, across in _AROUND:
        there = (j + down >= 0) & (j + down < grid.shape[0]) & (i + across >= 0) & (i + across < grid.shape[1])
        height = grid[j[there] + down, i[there] + across]
        np.fmin.at(lowest, hole[there], np.where(np.isfinite(height), height, np.inf))
    grid[j, i] = lowest[hole]
    at_edge = (j == 0) | (j == grid.shape[0] - 1) | (i == 0) | (i == grid.shape[1] - 1)
    open_holes = np.zeros(len(j), dtype=bool)
    open_holes[hole[at_edge]] = True
    if not open_holes.any():
        return None
    beyond = np.zeros(grid.shape, dtype=bool)
    beyond[j, i] = open_holes[hole]
    return beyond


def _links(
    number: NDArray[np.int64], j: NDArray[np.int64], i: NDArray[np.int64]
) -> Iterator[tuple[NDArray[np.int64], NDArray[np.int64]]]:
    """Pairs of neighbouring nodes of holes, each once."""
    for down, across in ((0, 1), (1, -1), (1, 0), (1, 1)):
        there = (j + down < number.shape[0]) & (i + across >= 0) & (i + across < number.shape[1])
        other = number[j[there] + down, i[there] + across]
        yield np.flatnonzero(there)[other >= 0], other[other >= 0]


def _components(size: int, links: list[tuple[NDArray[np.int64], NDArray[np.int64]]]) -> NDArray[np.int64]:
    """The first node of each node's hole: labels are lowered along the links and shortened until they stand."""
    label = np.arange(size)
    one, other = (np.concatenate(ends) for ends in zip(*links, strict=True))
    while len(one):
        low, high = np.minimum(label[one], label[other]), np.maximum(label[one], label[other])
        np.minimum.at(label, high, low)
        while not np.array_equal(shorter := label[label], label):
            label = shorter
        apart = label[one] != label[other]
        one, other = one[apart], other[apart]
    return label
