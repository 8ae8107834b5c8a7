"""Work on some rows of nodal vectors: whole arrays would cost more."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.vectors.transposition import address, prefetch

# Rows lie scattered: the one that comes so many later is fetched now.
_AHEAD = 16


@kernel
def place_rows(source: np.ndarray, rows: np.ndarray, target: np.ndarray) -> None:
    """Copy `source` (n, m) to the given rows of `target` (k, m)."""
    start, size = address(target), np.uint64(8 * target.shape[1])
    for k in range(rows.size):
        prefetch(start + size * np.uint64(rows[min(k + _AHEAD, rows.size - 1)]))
        row = np.uint64(rows[k])
        for i in range(source.shape[1]):
            target[row, i] = source[k, i]


@kernel
def hold_rows(values: np.ndarray, directions: np.ndarray, first: np.ndarray, rows: np.ndarray) -> None:
    """Take what rows of `values` (n, 3) have along unit vectors (k, 3) away, one direction after the other.

    Those of direction i are `rows`[first[i]:first[i + 1]], each of them once.
    """
    for i in range(directions.shape[0]):
        x, y, z = directions[i, 0], directions[i, 1], directions[i, 2]
        for k in range(first[i], first[i + 1]):
            row = rows[k]
            along = x * values[row, 0] + y * values[row, 1] + z * values[row, 2]
            values[row, 0] -= along * x
            values[row, 1] -= along * y
            values[row, 2] -= along * z


@kernel
def largest_speed(velocity: np.ndarray, nodes: np.ndarray) -> float:
    """Largest speed (m/s) among the given nodes."""
    largest = 0.0
    for k in range(nodes.size):
        node = np.uint64(nodes[k])
        largest = max(largest, velocity[node, 0] ** 2 + velocity[node, 1] ** 2 + velocity[node, 2] ** 2)
    return np.sqrt(largest)
