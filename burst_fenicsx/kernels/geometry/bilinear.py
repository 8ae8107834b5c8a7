"""The bilinear face between four nodes: its point closest to a place."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel

__all__ = ["closest_point"]

_NEWTON_STEPS = 4


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
