"""Sums over the points of every fragment."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from transition.kernels.compiling import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["chosen_points", "cluster_means", "collect"]


@kernel
def cluster_means(
    offset: NDArray[np.int64],
    point: NDArray[np.int64],
    piece: NDArray[np.float64],
    position: NDArray[np.float64],
    velocity: NDArray[np.float64],
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Mass-weighted means (n, 3) of the positions and velocities (p, 3) of points; others as in `placing.Clusters`."""
    places, velocities = np.zeros((offset.size - 1, 3)), np.zeros((offset.size - 1, 3))
    for f in range(offset.size - 1):
        mass = 0.0
        for i in range(offset[f], offset[f + 1]):
            m, p = piece[i], point[i]
            mass += m
            for k in range(3):
                places[f, k] += m * position[p, k]
                velocities[f, k] += m * velocity[p, k]
        for k in range(3):
            places[f, k] /= mass
            velocities[f, k] /= mass
    return places, velocities


@kernel
def chosen_points(
    offset: NDArray[np.int64], point: NDArray[np.int64], piece: NDArray[np.float64], target: NDArray[np.float64]
) -> NDArray[np.int64]:
    """Point (n,) of every fragment in which its pieces, added up in turn, reach the mass `target` (n,) (kg)."""
    chosen = np.empty(offset.size - 1, dtype=np.int64)
    for f in range(offset.size - 1):
        below, i = piece[offset[f]], offset[f]
        while below < target[f] and i + 1 < offset[f + 1]:
            i += 1
            below += piece[i]
        chosen[f] = point[i]
    return chosen


@kernel
def collect(
    first: NDArray[np.int64],
    offset: NDArray[np.int64],
    row: NDArray[np.float64],
    ident: NDArray[np.int64],
    mass: NDArray[np.float64],
    point: NDArray[np.int64],
    piece: NDArray[np.float64],
) -> None:
    """Copy the pieces of every fragment out of the rows of `bisection.bisect`.

    Parameters
    ----------
    first : (n,) int64
        First row of every fragment.
    offset : (n + 1,) int64
        Its pieces are to be `offset[f]` to `offset[f + 1]`.
    row, ident : (r, 4), (r,)
        Rows, with the mass (kg) in the last column, and their points.
    mass, point, piece : (n,), (p,), (p,)
        Written: masses of the fragments (kg), points and masses (kg) of the pieces.
    """
    for f in range(offset.size - 1):
        mass[f] = 0.0
        for i in range(offset[f + 1] - offset[f]):
            source, goal = first[f] + i, offset[f] + i
            point[goal], piece[goal] = ident[source], row[source, 3]
            mass[f] += row[source, 3]
