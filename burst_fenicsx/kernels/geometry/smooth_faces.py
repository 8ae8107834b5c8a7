"""Area vectors of quadrilaterals, and groups of those around a node that form one smooth surface there."""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.lanes import kernel, parallel_kernel

__all__ = ["face_vectors", "group_faces", "group_vectors"]


@kernel
def group_faces(
    faces: np.ndarray, normal: np.ndarray, row: np.ndarray, rows: int, smooth: float
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Group the faces around each node by direction.

    Parameters
    ----------
    faces : (faces, 4) nodes. normal : (faces, 3) unit vectors.
    row : (nodes,) row of a node, -1 where it has none. rows : their number.
    smooth : cosine above which a face belongs to the group of an earlier one.

    Returns
    -------
    first : (rows + 1,) int32, the groups of each row. first_face : (groups + 1,) int32 into `face`.
    face : int32, the faces of each group.
    """
    offset = np.zeros(rows + 1, dtype=np.int64)
    for face in range(faces.shape[0]):
        for corner in range(4):
            if row[faces[face, corner]] >= 0:
                offset[row[faces[face, corner]] + 1] += 1
    for node in range(rows):
        offset[node + 1] += offset[node]
    around, place = np.empty(offset[rows], dtype=np.int32), offset.copy()
    for face in range(faces.shape[0]):
        for corner in range(4):
            node = row[faces[face, corner]]
            if node >= 0:
                around[place[node]] = face
                place[node] += 1

    first, face_of = np.zeros(rows + 1, dtype=np.int32), np.empty(around.size, dtype=np.int32)
    first_face = np.zeros(around.size + 1, dtype=np.int32)
    group = np.empty(around.size, dtype=np.int32)
    springs, entered = 0, 0
    for node in range(rows):
        groups = 0
        for k in range(offset[node], offset[node + 1]):
            group[k] = groups
            known = 0
            for earlier in range(offset[node], k):
                if group[earlier] != known:
                    continue
                known += 1  # the first face of a group
                a, b = around[earlier], around[k]
                cosine = normal[a, 0] * normal[b, 0] + normal[a, 1] * normal[b, 1] + normal[a, 2] * normal[b, 2]
                if cosine > smooth:
                    group[k] = group[earlier]
                    break
            if group[k] == groups:
                groups += 1
        for number in range(groups):
            for k in range(offset[node], offset[node + 1]):
                if group[k] == number:
                    face_of[entered] = around[k]
                    entered += 1
            springs += 1
            first_face[springs] = entered
        first[node + 1] = springs
    return first, first_face[: springs + 1].copy(), face_of


@parallel_kernel
def face_vectors(position: np.ndarray, faces: np.ndarray, chosen: np.ndarray, vectors: np.ndarray) -> None:
    """Area vectors (m2) of the `chosen` of `faces` (faces, 4) into `vectors` (faces, 3)."""
    for k in numba.prange(chosen.size):
        face = chosen[k]
        a, b, c, d = faces[face, 0], faces[face, 1], faces[face, 2], faces[face, 3]
        x1, x2 = position[c, 0] - position[a, 0], position[d, 0] - position[b, 0]
        y1, y2 = position[c, 1] - position[a, 1], position[d, 1] - position[b, 1]
        z1, z2 = position[c, 2] - position[a, 2], position[d, 2] - position[b, 2]
        vectors[face, 0] = 0.5 * (y1 * z2 - z1 * y2)
        vectors[face, 1] = 0.5 * (z1 * x2 - x1 * z2)
        vectors[face, 2] = 0.5 * (x1 * y2 - y1 * x2)


@parallel_kernel
def group_vectors(
    first_face: np.ndarray, face: np.ndarray, chosen: np.ndarray, vectors: np.ndarray, total: np.ndarray
) -> None:
    """Sum the faces' area vectors (m2) over each of the `chosen` groups into `total` (groups, 3)."""
    for k in numba.prange(chosen.size):
        group = chosen[k]
        x, y, z = 0.0, 0.0, 0.0
        for at in range(first_face[group], first_face[group + 1]):
            x += vectors[face[at], 0]
            y += vectors[face[at], 1]
            z += vectors[face[at], 2]
        total[group, 0], total[group, 1], total[group, 2] = x, y, z
