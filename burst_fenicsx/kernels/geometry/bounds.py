"""Bounds of faces that exclude at little cost the nodes that cannot touch them.

A bilinear face lies within its corners, and each of its normals between those at its corners: a node above all corners
along all four normals is in front of the face, and one so far below them is at least as deep.
"""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.lanes import kernel, parallel_kernel

__all__ = ["bound_faces"]

_RUN = 64  # faces that share scratch
_ROUND_OFF = 1e-9  # of a face's size: much more than the rounding of its corners' places


@parallel_kernel
def bound_faces(
    position: np.ndarray,
    velocity: np.ndarray,
    faces: np.ndarray,
    near: np.ndarray,
    ball: np.ndarray,
    bound: np.ndarray,
) -> None:
    """Bounds of the faces `near`, by which most candidates are rejected: see `Collisions.ball` and `bound`."""
    parts = near.size // _RUN + 1
    for part in numba.prange(parts):
        x = np.empty((4, 3))
        for k in range(part * near.size // parts, (part + 1) * near.size // parts):
            _bound_face(near[k], position, velocity, faces, x, ball, bound)


@kernel
def _bound_face(
    face: int,
    position: np.ndarray,
    velocity: np.ndarray,
    faces: np.ndarray,
    x: np.ndarray,
    ball: np.ndarray,
    bound: np.ndarray,
) -> None:
    """Bounds of one face; `x` (4, 3) is scratch."""
    a, c = faces[face, 0], faces[face, 2]
    for i in range(3):
        ball[face, i] = 0.5 * (position[a, i] + position[c, i])
    size, speed = 0.0, 0.0
    for n in range(4):
        node = faces[face, n]
        speed = max(speed, velocity[node, 0] ** 2 + velocity[node, 1] ** 2 + velocity[node, 2] ** 2)
        for i in range(3):
            x[n, i] = position[node, i] - ball[face, i]
        size = max(size, x[n, 0] ** 2 + x[n, 1] ** 2 + x[n, 2] ** 2)
    ball[face, 3] = np.sqrt(size)
    ball[face, 4] = np.sqrt(speed)
    slack = _ROUND_OFF * np.sqrt(size)
    for n in range(4):
        # The normal at a corner of the bilinear face, from the two edges that end there.
        after, before = (n + 1) % 4, (n + 3) % 4
        ux, uy, uz = x[after, 0] - x[n, 0], x[after, 1] - x[n, 1], x[after, 2] - x[n, 2]
        vx, vy, vz = x[before, 0] - x[n, 0], x[before, 1] - x[n, 1], x[before, 2] - x[n, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        square = nx * nx + ny * ny + nz * nz
        inverse = 1.0 / np.sqrt(square) if square > 0.0 else 0.0
        nx, ny, nz = inverse * nx, inverse * ny, inverse * nz
        low, high = np.inf, -np.inf
        for m in range(4):
            height = x[m, 0] * nx + x[m, 1] * ny + x[m, 2] * nz
            low, high = min(low, height), max(high, height)
        at = 5 * n
        bound[face, at], bound[face, at + 1], bound[face, at + 2] = nx, ny, nz
        bound[face, at + 3], bound[face, at + 4] = low - slack, high + slack
