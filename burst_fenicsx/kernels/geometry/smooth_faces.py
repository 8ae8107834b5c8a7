"""Area vectors of quadrilaterals, and their sums over groups of faces."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.threads import on_threads

__all__ = ["face_vectors", "group_vectors"]


@kernel
def face_vectors(position: np.ndarray, faces: np.ndarray, chosen: np.ndarray, vectors: np.ndarray) -> None:
    """Area vectors (m2) of the `chosen` of `faces` (faces, 4) into `vectors` (faces, 3)."""
    on_threads(chosen.size, _face_vectors, (position, faces, chosen, vectors))


@kernel
def _face_vectors(
    first: int, last: int, position: np.ndarray, faces: np.ndarray, chosen: np.ndarray, vectors: np.ndarray
) -> None:
    for k in range(first, last):
        face = chosen[k]
        a, b, c, d = faces[face, 0], faces[face, 1], faces[face, 2], faces[face, 3]
        x1, x2 = position[c, 0] - position[a, 0], position[d, 0] - position[b, 0]
        y1, y2 = position[c, 1] - position[a, 1], position[d, 1] - position[b, 1]
        z1, z2 = position[c, 2] - position[a, 2], position[d, 2] - position[b, 2]
        vectors[face, 0] = 0.5 * (y1 * z2 - z1 * y2)
        vectors[face, 1] = 0.5 * (z1 * x2 - x1 * z2)
        vectors[face, 2] = 0.5 * (x1 * y2 - y1 * x2)


@kernel
def group_vectors(
    first_face: np.ndarray, face: np.ndarray, chosen: np.ndarray, vectors: np.ndarray, total: np.ndarray
) -> None:
    """Sum the faces' area vectors (m2) over each of the `chosen` groups into `total` (groups, 3)."""
    on_threads(chosen.size, _group_vectors, (first_face, face, chosen, vectors, total))


@kernel
def _group_vectors(
    first: int,
    last: int,
    first_face: np.ndarray,
    face: np.ndarray,
    chosen: np.ndarray,
    vectors: np.ndarray,
    total: np.ndarray,
) -> None:
    for k in range(first, last):
        group = chosen[k]
        x, y, z = 0.0, 0.0, 0.0
        for at in range(first_face[group], first_face[group + 1]):
            x += vectors[face[at], 0]
            y += vectors[face[at], 1]
            z += vectors[face[at], 2]
        total[group, 0], total[group, 1], total[group, 2] = x, y, z
