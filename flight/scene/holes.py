"""Holes of a map of heights: filled from their rims, and which are too wide to be known by them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    Indices = NDArray[np.int64]


_AROUND = [(j, i) for j in (-1, 0, 1) for i in (-1, 0, 1) if (j, i) != (0, 0)]
_NARROW, _NARROW_NODES = 30.0, 4  # m, and nodes: a hole as wide as one of them is known by its rim


def fill_holes(grid: NDArray[np.float64], step: tuple[float, float]) -> NDArray[np.bool_] | None:
    """Fill the holes in place: from the rim inwards the mean of those of eight neighbours that have a height.

    `grid` (rows, columns) holds heights (m), not finite in holes, one at least finite; its columns and rows are `step`
    (m) apart. Returned are the nodes of holes that reach the map's edge, or are wider than 30 m and four nodes, as what
    is filled in there is no knowledge; None without such holes.
    """
    missing = ~np.isfinite(grid)
    beyond = _unknown(missing, step)
    grid[missing] = 0.0
    j, i = np.nonzero(missing)
    while len(j):
        total, count = np.zeros(len(j)), np.zeros(len(j))
        for down, across in _AROUND:
            there = (j + down >= 0) & (j + down < grid.shape[0]) & (i + across >= 0) & (i + across < grid.shape[1])
            known = np.zeros(len(j), dtype=bool)
            known[there] = ~missing[j[there] + down, i[there] + across]
            total[known] += grid[j[known] + down, i[known] + across]
            count += known
        rim = count > 0
        grid[j[rim], i[rim]] = total[rim] / count[rim]
        missing[j[rim], i[rim]] = False
        j, i = j[~rim], i[~rim]
    return beyond


def _unknown(missing: NDArray[np.bool_], step: tuple[float, float]) -> NDArray[np.bool_] | None:
    """Nodes of the holes that are too wide, or open to the edge."""
    j, i = np.nonzero(missing)
    number = np.full(missing.shape, -1, dtype=np.int64)
    number[j, i] = np.arange(len(j))
    hole = _components(len(j), list(_links(number, j, i)))
    wide = np.zeros(len(j), dtype=bool)
    for index, size, last in ((i, step[0], missing.shape[1] - 1), (j, step[1], missing.shape[0] - 1)):
        low, high = np.full(len(j), last), np.zeros(len(j), dtype=np.int64)
        np.minimum.at(low, hole, index)
        np.maximum.at(high, hole, index)
        nodes = high - low + 1
        wide |= (low == 0) | (high == last) | ((nodes > _NARROW_NODES) & (nodes * size > _NARROW))
    if not wide[hole].any():
        return None
    beyond = np.zeros(missing.shape, dtype=bool)
    beyond[j, i] = wide[hole]
    return beyond


def _links(number: Indices, j: Indices, i: Indices) -> Iterator[tuple[Indices, Indices]]:
    """Pairs of neighbouring nodes of holes, each once."""
    for down, across in ((0, 1), (1, -1), (1, 0), (1, 1)):
        there = (j + down < number.shape[0]) & (i + across >= 0) & (i + across < number.shape[1])
        other = number[j[there] + down, i[there] + across]
        yield np.flatnonzero(there)[other >= 0], other[other >= 0]


def _components(size: int, links: list[tuple[Indices, Indices]]) -> Indices:
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
