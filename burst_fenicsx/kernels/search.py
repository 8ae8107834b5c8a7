"""Which faces a node may meet before the next search: a spatial hash of the faces' boxes.

Every face is entered in all cells of a regular grid that its box touches, the box widened by the reach; a node then
looks into its own cell alone. The cells are hashed into a table, so that a wide field of fragments costs no memory.
"""

from __future__ import annotations

from typing import NamedTuple

import numba
import numpy as np

from burst_fenicsx.kernels.lanes import kernel, parallel_kernel

__all__ = ["Bodies", "face_boxes", "find_candidates", "node_normals"]

# A node meets a face of its own body only where their normals are opposed: cosine below this.
_OPPOSED = -0.2


class Bodies(NamedTuple):
    """The surfaces that may meet; nodes are numbered among the surface nodes."""

    faces: np.ndarray  # (faces, 4) int32, outward order
    face_body: np.ndarray  # (faces,) int32
    node_body: np.ndarray  # (nodes,) int32
    face_round: np.ndarray  # (faces,) int32
    node_round: np.ndarray  # (nodes,) int32


@parallel_kernel
def face_boxes(position: np.ndarray, faces: np.ndarray, reach: np.ndarray, boxes: np.ndarray) -> None:
    """Boxes (faces, 6) of quadrilaterals, low then high corner (m), widened by each one's `reach` (m)."""
    for face in numba.prange(faces.shape[0]):
        for i in range(3):
            low, high = np.inf, -np.inf
            for k in range(4):
                x = position[faces[face, k], i]
                low, high = min(low, x), max(high, x)
            boxes[face, i] = low - reach[face]
            boxes[face, 3 + i] = high + reach[face]


@kernel
def node_normals(position: np.ndarray, faces: np.ndarray, normals: np.ndarray) -> None:
    """Sum of the area vectors of the faces around each node (nodes, 3) in m2."""
    normals[:] = 0.0
    for face in range(faces.shape[0]):
        a, b, c, d = faces[face, 0], faces[face, 1], faces[face, 2], faces[face, 3]
        x1, x2 = position[c, 0] - position[a, 0], position[d, 0] - position[b, 0]
        y1, y2 = position[c, 1] - position[a, 1], position[d, 1] - position[b, 1]
        z1, z2 = position[c, 2] - position[a, 2], position[d, 2] - position[b, 2]
        for k in range(4):
            node = faces[face, k]
            normals[node, 0] += y1 * z2 - z1 * y2
            normals[node, 1] += z1 * x2 - x1 * z2
            normals[node, 2] += x1 * y2 - y1 * x2


@kernel
def _hash(x: int, y: int, z: int, mask: int) -> int:
    """Bucket of a grid cell (the primes of Teschner et al. 2003)."""
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & mask


@kernel
def _fill_table(boxes: np.ndarray, cell: float, mask: int) -> tuple[np.ndarray, np.ndarray]:
    """Offsets of the buckets and the faces in them, by counting."""
    offset = np.zeros(mask + 2, dtype=np.int64)
    for fill in range(2):
        if fill:
            for bucket in range(mask + 1):
                offset[bucket + 1] += offset[bucket]
            entries = np.empty(offset[mask + 1], dtype=np.int32)
            place = offset.copy()
        for face in range(boxes.shape[0]):
            for x in range(int(np.floor(boxes[face, 0] / cell)), int(np.floor(boxes[face, 3] / cell)) + 1):
                for y in range(int(np.floor(boxes[face, 1] / cell)), int(np.floor(boxes[face, 4] / cell)) + 1):
                    for z in range(int(np.floor(boxes[face, 2] / cell)), int(np.floor(boxes[face, 5] / cell)) + 1):
                        bucket = _hash(x, y, z, mask)
                        if fill:
                            entries[place[bucket]] = face
                            place[bucket] += 1
                        else:
                            offset[bucket + 1] += 1
    return offset, entries


@kernel
def _may_meet(
    node: int, face: int, bodies: Bodies, free: np.ndarray, normals: np.ndarray, position: np.ndarray
) -> bool:
    """Whether a node within a face's box may touch the face before the next search."""
    if bodies.node_round[node] != bodies.face_round[face]:
        return True
    a, b, c, d = bodies.faces[face, 0], bodies.faces[face, 1], bodies.faces[face, 2], bodies.faces[face, 3]
    if bodies.node_body[node] != bodies.face_body[face]:
        return free[node] != 0  # charge and casing of one round: only where their bond has let go
    if node in (a, b, c, d):
        return False
    x1, x2 = position[c, 0] - position[a, 0], position[d, 0] - position[b, 0]
    y1, y2 = position[c, 1] - position[a, 1], position[d, 1] - position[b, 1]
    z1, z2 = position[c, 2] - position[a, 2], position[d, 2] - position[b, 2]
    nx, ny, nz = y1 * z2 - z1 * y2, z1 * x2 - x1 * z2, x1 * y2 - y1 * x2
    along = nx * normals[node, 0] + ny * normals[node, 1] + nz * normals[node, 2]
    square = (nx * nx + ny * ny + nz * nz) * (normals[node, 0] ** 2 + normals[node, 1] ** 2 + normals[node, 2] ** 2)
    return along < _OPPOSED * np.sqrt(square)


@kernel
def find_candidates(
    position: np.ndarray,
    bodies: Bodies,
    active: np.ndarray,
    free: np.ndarray,
    normals: np.ndarray,
    boxes: np.ndarray,
    cell: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Faces that each active node may meet: offsets (active + 1,) and faces, in ascending order.

    Parameters
    ----------
    position : (nodes, 3) m, of the surface nodes.
    active : (active,) int32, nodes that look for faces.
    free : (nodes,) int8, not 0 where a bond has let go: the node may meet the other part of its own round.
    normals : (nodes, 3), from `node_normals`.
    boxes : (faces, 6) m, from `face_boxes`, widened by the reach.
    cell : edge of the grid (m).
    """
    mask = 1
    while mask < 2 * boxes.shape[0]:
        mask *= 2
    mask -= 1
    offset, entries = _fill_table(boxes, cell, mask)
    first = np.zeros(active.size + 1, dtype=np.int64)
    _look_up(position, bodies, active, free, normals, boxes, cell, mask, offset, entries, first, entries[:0])
    for k in range(active.size):
        first[k + 1] += first[k]
    found = np.empty(first[-1], dtype=np.int32)
    _look_up(position, bodies, active, free, normals, boxes, cell, mask, offset, entries, first, found)
    return first, found


@parallel_kernel
def _look_up(
    position: np.ndarray,
    bodies: Bodies,
    active: np.ndarray,
    free: np.ndarray,
    normals: np.ndarray,
    boxes: np.ndarray,
    cell: float,
    mask: int,
    offset: np.ndarray,
    entries: np.ndarray,
    first: np.ndarray,
    found: np.ndarray,
) -> None:
    """Count each active node's faces into `first[k + 1]`, or, once `found` has room, write them."""
    for k in numba.prange(active.size):
        node = active[k]
        px, py, pz = position[node, 0], position[node, 1], position[node, 2]
        bucket = _hash(int(np.floor(px / cell)), int(np.floor(py / cell)), int(np.floor(pz / cell)), mask)
        last = -1
        count = 0
        for entry in range(offset[bucket], offset[bucket + 1]):
            face = entries[entry]
            # The box is looked at here and not in a function: most faces fail, and a call costs more than the look.
            if px < boxes[face, 0] or px > boxes[face, 3] or py < boxes[face, 1] or py > boxes[face, 4]:
                continue
            if pz < boxes[face, 2] or pz > boxes[face, 5]:
                continue
            if face == last:  # entered twice: two of its cells share the bucket; entries of a bucket ascend
                continue
            last = face
            if _may_meet(node, face, bodies, free, normals, position):
                if found.size:
                    found[first[k] + count] = face
                count += 1
        if not found.size:
            first[k + 1] = count
