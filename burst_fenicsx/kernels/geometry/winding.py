"""How often closed surfaces of quadrilaterals wind around points."""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.lanes import kernel, parallel_kernel

__all__ = ["add_windings"]


@parallel_kernel
def add_windings(points: np.ndarray, position: np.ndarray, faces: np.ndarray, windings: np.ndarray) -> None:
    """Add to `windings` (points,) the solid angles that faces take up seen from points, over that of a sphere.

    A closed surface that looks outward adds 1 at each point within it and 0 at each point outside. Each face is made
    of four triangles about its centre (van Oosterom and Strackee 1983, Eq. 8).

    Parameters
    ----------
    points : (points, 3) m. position : (nodes, 3) m. faces : (faces, 4) their nodes in outward order.
    """
    for k in numba.prange(points.shape[0]):
        turned = 0.0
        for face in range(faces.shape[0]):
            turned += _solid_angle(points, k, position, faces, face)
        windings[k] += turned / (4.0 * np.pi)


@kernel
def _solid_angle(points: np.ndarray, k: int, position: np.ndarray, faces: np.ndarray, face: int) -> float:
    """Solid angle of a face seen from the k-th point, positive where its back is seen."""
    cx, cy, cz = 0.0, 0.0, 0.0
    for n in range(4):
        cx += 0.25 * (position[faces[face, n], 0] - points[k, 0])
        cy += 0.25 * (position[faces[face, n], 1] - points[k, 1])
        cz += 0.25 * (position[faces[face, n], 2] - points[k, 2])
    c = np.sqrt(cx * cx + cy * cy + cz * cz)
    angle = 0.0
    for n in range(4):
        here, there = faces[face, n], faces[face, (n + 1) % 4]
        ax, ay, az = (
            position[here, 0] - points[k, 0],
            position[here, 1] - points[k, 1],
            position[here, 2] - points[k, 2],
        )
        bx, by = position[there, 0] - points[k, 0], position[there, 1] - points[k, 1]
        bz = position[there, 2] - points[k, 2]
        a, b = np.sqrt(ax * ax + ay * ay + az * az), np.sqrt(bx * bx + by * by + bz * bz)
        triple = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        below = (
            a * b * c + (ax * bx + ay * by + az * bz) * c + (bx * cx + by * cy + bz * cz) * a
            + (cx * ax + cy * ay + cz * az) * b
        )  # fmt: skip
        angle += 2.0 * np.arctan2(triple, below)
    return angle
