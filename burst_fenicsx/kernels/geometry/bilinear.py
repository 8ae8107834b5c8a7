"""The bilinear face between four nodes: its point closest to a place, and bounds that exclude nodes at little cost.

A bilinear face lies within its corners, and each of its normals between those at its corners: a node above all corners
along all four normals is in front of the face, and one so far below them is at least as deep.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.threads import on_threads

__all__ = ["bound_faces", "closest_point"]

_NEWTON_STEPS = 4
_ROUND_OFF = 1e-9  # of a face's size: much more than the rounding of its corners' places


@kernel
def closest_point(x: float, y: float, z: float, corner: np.ndarray, result: np.ndarray) -> None:
    """Closest point of a bilinear face: xi, eta within [-1, 1], the place (3), the unit normal (3).

    `corner` (4, 3) m in outward order; `result` (8,), overwritten. Gauss-Newton steps from the centre.
    """
    xi, eta = 0.0, 0.0
    for step in range(_NEWTON_STEPS + 1):
        a, b = 0.25 * (1.0 - xi), 0.25 * (1.0 + xi)
        w0, w1, w2, w3 = a * (1.0 - eta), b * (1.0 - eta), b * (1.0 + eta), a * (1.0 + eta)
        px = w0 * corner[0, 0] + w1 * corner[1, 0] + w2 * corner[2, 0] + w3 * corner[3, 0]
        py = w0 * corner[0, 1] + w1 * corner[1, 1] + w2 * corner[2, 1] + w3 * corner[3, 1]
        pz = w0 * corner[0, 2] + w1 * corner[1, 2] + w2 * corner[2, 2] + w3 * corner[3, 2]
        c, d = 0.25 * (1.0 - eta), 0.25 * (1.0 + eta)
        ux = c * (corner[1, 0] - corner[0, 0]) + d * (corner[2, 0] - corner[3, 0])
        uy = c * (corner[1, 1] - corner[0, 1]) + d * (corner[2, 1] - corner[3, 1])
        uz = c * (corner[1, 2] - corner[0, 2]) + d * (corner[2, 2] - corner[3, 2])
        vx = a * (corner[3, 0] - corner[0, 0]) + b * (corner[2, 0] - corner[1, 0])
        vy = a * (corner[3, 1] - corner[0, 1]) + b * (corner[2, 1] - corner[1, 1])
        vz = a * (corner[3, 2] - corner[0, 2]) + b * (corner[2, 2] - corner[1, 2])
        if step == _NEWTON_STEPS:
            break
        rx, ry, rz = x - px, y - py, z - pz
        uu, uv, vv = ux * ux + uy * uy + uz * uz, ux * vx + uy * vy + uz * vz, vx * vx + vy * vy + vz * vz
        ru, rv = rx * ux + ry * uy + rz * uz, rx * vx + ry * vy + rz * vz
        determinant = uu * vv - uv * uv
        last_xi, last_eta = xi, eta
        if determinant > 1e-12 * uu * vv:
            xi += (vv * ru - uv * rv) / determinant
            eta += (uu * rv - uv * ru) / determinant
        xi, eta = min(max(xi, -1.0), 1.0), min(max(eta, -1.0), 1.0)
        if xi == last_xi and eta == last_eta:
            break
    nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
    size = np.sqrt(nx * nx + ny * ny + nz * nz)
    inverse = 1.0 / size if size > 0.0 else 0.0
    result[0], result[1] = xi, eta
    result[2], result[3], result[4] = px, py, pz
    result[5], result[6], result[7] = nx * inverse, ny * inverse, nz * inverse


@kernel
def bound_faces(
    position: np.ndarray,
    velocity: np.ndarray,
    faces: np.ndarray,
    near: np.ndarray,
    ball: np.ndarray,
    bound: np.ndarray,
) -> None:
    """Bounds of the faces `near`, by which most candidates are rejected: see `Collisions.ball` and `bound`."""
    on_threads(near.size, _bound_some, (near, position, velocity, faces, ball, bound))


@kernel
def _bound_some(
    first: int,
    last: int,
    near: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    faces: np.ndarray,
    ball: np.ndarray,
    bound: np.ndarray,
) -> None:
    x = np.empty((4, 3))
    for k in range(first, last):
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
