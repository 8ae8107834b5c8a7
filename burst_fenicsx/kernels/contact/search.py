"""Which faces a node may meet before the next search: a spatial hash of the faces' boxes.

Every face is entered in all cells of a regular grid that its box touches, the box widened by the reach; a node then
looks into its own cell alone. The cells are hashed into a table, so that a wide field of fragments costs no memory.

Trees of points (SciPy's) take twenty times as long where a wall is near itself everywhere and meets itself nowhere.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.threads import on_threads

# A node meets a face of its own round only where their normals are opposed: cosine below this.
_OPPOSED = -0.2
_SLACK = 1e-5  # of the cosine: far more than single precision's rounding of normals


class Bodies(NamedTuple):
    """The surfaces that may meet; nodes are numbered among the surface nodes."""

    faces: np.ndarray  # (faces, 4) int32, outward order
    face_round: np.ndarray  # (faces,) int32
    node_round: np.ndarray  # (nodes,) int32
    within: np.ndarray  # (faces,) bool, whether a face lies within a casing: nodes of its own round never meet it


@kernel
def face_shapes(
    position: np.ndarray, faces: np.ndarray, chosen: np.ndarray, reach: np.ndarray, on_surface: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Boxes (k, 6) m, low then high corner, of the `chosen` faces (k,), each widened by its `reach` (k,) m.

    Besides, the faces' area vectors (k, 3) m2 and their sum at every node (nodes, 3), of the first `on_surface` faces.
    """
    boxes, areas = np.empty((chosen.size, 6)), np.empty((chosen.size, 3))
    normals = np.zeros_like(position)
    for k in range(chosen.size):
        face = chosen[k]
        p, q, r, s = faces[face, 0], faces[face, 1], faces[face, 2], faces[face, 3]
        for i in range(3):
            a, b, c, d = position[p, i], position[q, i], position[r, i], position[s, i]
            boxes[k, i] = min(a, b, c, d) - reach[k]
            boxes[k, 3 + i] = max(a, b, c, d) + reach[k]
            x, y = (i + 1) % 3, (i + 2) % 3
            one = (position[r, x] - position[p, x]) * (position[s, y] - position[q, y])
            areas[k, i] = 0.5 * (one - (position[r, y] - position[p, y]) * (position[s, x] - position[q, x]))
        if face < on_surface:
            for corner in range(4):
                for i in range(3):
                    normals[faces[face, corner], i] += areas[k, i]
    return boxes, areas, normals


@kernel
def _hash(x: int, y: int, z: int, mask: int) -> int:
    """Bucket of a grid cell (the primes of Teschner et al. 2003)."""
    return ((x * 73856093) ^ (y * 19349663) ^ (z * 83492791)) & mask


@kernel
def _fill_table(boxes: np.ndarray, cell: float, mask: int) -> tuple[np.ndarray, np.ndarray]:
    """Offsets of the buckets and the faces in them, by counting."""
    offset = np.zeros(mask + 2, dtype=np.int64)
    span = np.empty((boxes.shape[0], 6), dtype=np.int32)
    for face in range(boxes.shape[0]):
        for i in range(6):
            span[face, i] = int(np.floor(boxes[face, i] / cell))
    for fill in range(2):
        if fill:
            for bucket in range(mask + 1):
                offset[bucket + 1] += offset[bucket]
            entries = np.empty(offset[mask + 1], dtype=np.int32)
            next_entry = offset.copy()
        for face in range(boxes.shape[0]):
            for x in range(span[face, 0], span[face, 3] + 1):
                for y in range(span[face, 1], span[face, 4] + 1):
                    for z in range(span[face, 2], span[face, 5] + 1):
                        bucket = _hash(x, y, z, mask)
                        if fill:
                            entries[next_entry[bucket]] = face
                            next_entry[bucket] += 1
                        else:
                            offset[bucket + 1] += 1
    return offset, entries


@kernel
def _bound_normals(
    offset: np.ndarray, entries: np.ndarray, face_round: np.ndarray, areas: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Of each bucket the round of its faces, -1 where there are several, and bounds of their unit normals (buckets, 6).

    A wall that is not folded looks one way: none of its nodes is opposed to any face near it, which one look at the
    bounds shows for all of a bucket.
    """
    buckets = offset.size - 1
    whose, bound = np.full(buckets, -1, dtype=np.int32), np.empty((buckets, 6), dtype=np.float32)
    normal = np.empty((areas.shape[0], 3), dtype=np.float32)
    for face in range(areas.shape[0]):
        size = np.sqrt(areas[face, 0] ** 2 + areas[face, 1] ** 2 + areas[face, 2] ** 2)
        for i in range(3):
            normal[face, i] = areas[face, i] / size if size > 0.0 else 0.0
    for bucket in range(buckets):
        begin, end = offset[bucket], offset[bucket + 1]
        if begin == end:
            continue
        for i in range(3):
            bound[bucket, i], bound[bucket, 3 + i] = 1.0, -1.0
        whose[bucket] = face_round[entries[begin]]
        for entry in range(begin, end):
            face = entries[entry]
            if face_round[face] != whose[bucket]:
                whose[bucket] = -1
                break
            for i in range(3):
                bound[bucket, i] = min(bound[bucket, i], normal[face, i])
                bound[bucket, 3 + i] = max(bound[bucket, 3 + i], normal[face, i])
    return whose, bound


@kernel
def find_candidates(
    position: np.ndarray,
    bodies: Bodies,
    areas: np.ndarray,
    active: np.ndarray,
    normals: np.ndarray,
    boxes: np.ndarray,
    cell: float,
) -> tuple[np.ndarray, np.ndarray]:
    """Faces that each active node may meet: offsets (active + 1,) and faces, in ascending order.

    Parameters
    ----------
    position : (nodes, 3) m, of the surface nodes.
    areas : (faces, 3) m2, area vectors of the bodies' faces.
    active : (active,) int32, nodes that look for faces.
    normals : (nodes, 3), sums of the area vectors around each node; of inner nodes zero.
    boxes : (faces, 6) m, low then high corner, widened by the reach.
    cell : edge of the grid (m).
    """
    mask = 1
    while mask < 2 * boxes.shape[0]:
        mask *= 2
    offset, entries = _fill_table(boxes, cell, mask - 1)
    whose, bound = _bound_normals(offset, entries, bodies.face_round, areas)
    # Room for all faces of a node's bucket: a list to grow in, or to count them first, would take as long again.
    first, bucket = np.zeros(active.size + 1, dtype=np.int64), np.empty(active.size, dtype=np.int64)
    _find_buckets(position, active, normals, bodies.node_round, cell, whose, bound, bucket)
    for k in range(active.size):
        first[k + 1] = first[k] + (offset[bucket[k] + 1] - offset[bucket[k]] if bucket[k] >= 0 else 0)
    found, count = np.empty(first[-1], dtype=np.int32), np.zeros(active.size, dtype=np.int64)
    # Bucket by bucket, one row for each side of the boxes: a node's comparisons are then vectors'.
    sides = np.empty((6, entries.size))
    for i in range(6):
        for entry in range(entries.size):
            sides[i, entry] = boxes[entries[entry], i]
    shared = position, bodies, areas, active, normals, sides, offset, entries, bucket, first, found, count
    on_threads(active.size, _look_up, shared)
    total = 0
    for k in range(active.size):
        start, first[k] = first[k], total
        for c in range(count[k]):
            found[total + c] = found[start + c]
        total += count[k]
    first[-1] = total
    return first, found[:total].copy()


@kernel
def _find_buckets(
    position: np.ndarray,
    active: np.ndarray,
    normals: np.ndarray,
    node_round: np.ndarray,
    cell: float,
    whose: np.ndarray,
    bound: np.ndarray,
    bucket: np.ndarray,
) -> None:
    """The bucket (active,) in which each active node looks for faces; -1 where the node is opposed to none of them."""
    for k in range(active.size):
        node = active[k]
        px, py, pz = position[node, 0], position[node, 1], position[node, 2]
        nx, ny, nz = normals[node, 0], normals[node, 1], normals[node, 2]
        b = _hash(int(np.floor(px / cell)), int(np.floor(py / cell)), int(np.floor(pz / cell)), whose.size - 1)
        opposed = min(nx * bound[b, 0], nx * bound[b, 3])
        opposed += min(ny * bound[b, 1], ny * bound[b, 4])
        opposed += min(nz * bound[b, 2], nz * bound[b, 5])
        none = opposed >= (_OPPOSED + _SLACK) * np.sqrt(nx**2 + ny**2 + nz**2)
        bucket[k] = -1 if whose[b] == node_round[node] and none else b


@kernel
def _look_up(
    start: int,
    stop: int,
    position: np.ndarray,
    bodies: Bodies,
    areas: np.ndarray,
    active: np.ndarray,
    normals: np.ndarray,
    sides: np.ndarray,
    offset: np.ndarray,
    entries: np.ndarray,
    bucket: np.ndarray,
    first: np.ndarray,
    found: np.ndarray,
    count: np.ndarray,
) -> None:
    """Write each active node's faces into `found` from `first` on, and how many these are into `count`.

    The conditions stand here and not in a function: most faces fail them, and a call costs more than the look.
    """
    faces, face_round, within = bodies.faces, bodies.face_round, bodies.within
    fullest = 0
    for k in range(start, stop):
        if bucket[k] >= 0:
            fullest = max(fullest, offset[bucket[k] + 1] - offset[bucket[k]])
    inside = np.empty(fullest, dtype=np.bool_)
    for k in range(start, stop):
        if bucket[k] < 0:
            continue
        node = active[k]
        px, py, pz = position[node, 0], position[node, 1], position[node, 2]
        nx, ny, nz = normals[node, 0], normals[node, 1], normals[node, 2]
        own_round, last, last_entry = bodies.node_round[node], -1, first[k]
        begin, end = offset[bucket[k]], offset[bucket[k] + 1]
        low_x, low_y, low_z = sides[0, begin:end], sides[1, begin:end], sides[2, begin:end]
        high_x, high_y, high_z = sides[3, begin:end], sides[4, begin:end], sides[5, begin:end]
        for entry in range(end - begin):
            x_inside = (px >= low_x[entry]) & (px <= high_x[entry])
            y_inside = (py >= low_y[entry]) & (py <= high_y[entry])
            inside[entry] = x_inside & y_inside & (pz >= low_z[entry]) & (pz <= high_z[entry])
        for entry in range(end - begin):
            if not inside[entry]:
                continue
            face = entries[begin + entry]
            if face == last:  # again: two of its cells share the bucket, whose entries ascend
                continue
            last = face
            if face_round[face] == own_round:
                if within[face]:
                    continue
                ax, ay, az = areas[face, 0], areas[face, 1], areas[face, 2]
                square = (ax * ax + ay * ay + az * az) * (nx**2 + ny**2 + nz**2)
                if not ax * nx + ay * ny + az * nz < _OPPOSED * np.sqrt(square):
                    continue
                own = (faces[face, 0] == node) | (faces[face, 1] == node)
                if own | (faces[face, 2] == node) | (faces[face, 3] == node):
                    continue
            found[last_entry] = face
            last_entry += 1
        count[k] = last_entry - first[k]
