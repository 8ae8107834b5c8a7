"""Where nodes of a charge lie on the casing's faces: points followed from face to face, sixteen side by side.

How many steps a point needs differs: a lane whose point is found takes the next one at once.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from burst_fenicsx.kernels.contact.coulomb import add_product, product
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.vectors.tensors import Vector, load_vector, store_vector
from burst_fenicsx.kernels.vectors.transposition import address, prefetch

__all__ = ["BEYOND", "GAP", "NORMAL", "POINT_ROWS", "SIZE", "SlideSurface", "find_points"]

_NEWTON, _WALKS = 12, 10
_CLOSE = 1e-9  # change of a face's coordinates below which a point is found: the error left is far smaller
_TIE = 1e-12  # by which a point may lie over an edge; larger with every face, so that the search ends
_LARGER = 16.0
_AHEAD, _NODE_BYTES = 24, np.uint64(24)

# Rows of the scratch: the node, the corners of its face and their area vectors, coordinates in the face; then what a
# step of Newton's iteration finds.
_NODE, _PLACE, _VECTOR, _XI, _ETA = 0, 3, 15, 27, 28
_GAP, _NORMAL, _SIZE, _ALONG, _NEW_XI, _NEW_ETA, _CHANGE = 29, 30, 33, 34, 37, 38, 39
_EXCESS = 40  # what a coordinate may exceed 1 by in the face
POINT_ROWS = 41
"""Of the scratch."""

GAP, NORMAL, BEYOND, SIZE = 0, 1, 4, 5
"""Columns of what `find_points` finds: gap (m), unit normal, distance (m) of a node beyond the surface's edge, size of
the interpolated area vector (m2)."""

_Sums: TypeAlias = tuple[Vector, Vector, Vector, Vector]


class SlideSurface(NamedTuple):
    """Faces that the charge may slide on; a group is a corner node with those of its faces that are smooth together."""

    faces: np.ndarray  # (faces, 4) int32, rows of the casing's interface nodes, outward from the casing
    neighbour: np.ndarray  # (faces, 4) int32, face across the edge from corner k to k + 1; -1 across a crease
    corner: np.ndarray  # (faces, 4) int32, group of each corner
    first_face: np.ndarray  # (groups + 1,) int32 into `face`
    face: np.ndarray  # int32, faces of each group
    known: np.ndarray  # (faces,) bool, whether this rank knows the positions of the face and of those around it
    vector: np.ndarray  # (groups, 3) m2, sum of the groups' area vectors, now


@lane_function
def _add_corner(k: int, s: float, t: float, xi: float, eta: float, sums: _Sums, work: np.ndarray, lane: int) -> _Sums:
    """Add a corner, at xi = s and eta = t, to the tangents, the place and the area vector at a point of a face."""
    a, b, x, v = sums
    corner, vector = load_vector(work, _PLACE + 3 * k, lane), load_vector(work, _VECTOR + 3 * k, lane)
    w = 0.25 * (1.0 + s * xi) * (1.0 + t * eta)
    a = add_product(a, 0.25 * s * (1.0 + t * eta), corner)
    b = add_product(b, 0.25 * t * (1.0 + s * xi), corner)
    return a, b, add_product(x, w, corner), add_product(v, w, vector)


@block_kernel
def _improve(work: np.ndarray) -> None:
    """Take one step of Newton's iteration in every lane, to the point from which the normal leads to the node."""
    widest_vectors()
    for lane in range(LANES):
        xi, eta = work[_XI * LANES + lane], work[_ETA * LANES + lane]
        zero = (0.0, 0.0, 0.0)
        sums = _add_corner(0, -1.0, -1.0, xi, eta, (zero, zero, zero, zero), work, lane)
        sums = _add_corner(1, 1.0, -1.0, xi, eta, sums, work, lane)
        sums = _add_corner(2, 1.0, 1.0, xi, eta, sums, work, lane)
        a, b, x, v = _add_corner(3, -1.0, 1.0, xi, eta, sums, work, lane)
        size = np.sqrt(product(v, v))
        n = (v[0] / size, v[1] / size, v[2] / size)
        r = add_product(load_vector(work, _NODE, lane), -1.0, x)
        gap = product(r, n)
        along = add_product(r, -gap, n)
        a, b = add_product(a, -product(a, n), n), add_product(b, -product(b, n), n)
        aa, ab, bb, at, bt = product(a, a), product(a, b), product(b, b), product(a, along), product(b, along)
        inverse = 1.0 / (aa * bb - ab * ab)
        d_xi, d_eta = inverse * (bb * at - ab * bt), inverse * (aa * bt - ab * at)
        work[_GAP * LANES + lane] = gap
        store_vector(n, work, _NORMAL, lane)
        work[_SIZE * LANES + lane] = size
        store_vector(along, work, _ALONG, lane)
        work[_NEW_XI * LANES + lane] = min(max(xi + d_xi, -4.0), 4.0)
        work[_NEW_ETA * LANES + lane] = min(max(eta + d_eta, -4.0), 4.0)
        work[_CHANGE * LANES + lane] = abs(d_xi) + abs(d_eta)


@block_kernel
def _load_face(
    lane: int,
    face: int,
    xi: float,
    eta: float,
    faces: np.ndarray,
    corner: np.ndarray,
    position: np.ndarray,
    vector: np.ndarray,
    work: np.ndarray,
) -> None:
    """Put a point of a face, the face's corners and their area vectors into a lane."""
    work[_XI * LANES + lane], work[_ETA * LANES + lane] = xi, eta
    for k in range(4):
        row, group = np.uint64(faces[face, k]), np.uint64(corner[face, k])
        for i in range(3):
            work[(_PLACE + 3 * k + i) * LANES + lane] = position[row, i]
            work[(_VECTOR + 3 * k + i) * LANES + lane] = vector[group, i]


@block_kernel
def _across(face: int, xi: float, eta: float, allowed: float, neighbour: np.ndarray, known: np.ndarray) -> int:
    """Face across the edge that a point lies beyond most, by more than `allowed`, and that leads on; else -1."""
    best, farthest = -1, allowed
    for edge in range(4):
        over = -eta if edge == 0 else (xi if edge == 1 else (eta if edge == 2 else -xi))
        other = neighbour[face, edge]
        if over > farthest and other >= 0 and known[other]:
            best, farthest = other, over
    return best


@block_kernel
def find_points(
    contact: np.ndarray,
    slave: np.ndarray,
    charge_position: np.ndarray,
    charge_velocity: np.ndarray,
    surface: SlideSurface,
    position: np.ndarray,
    face: np.ndarray,
    point: np.ndarray,
    found: np.ndarray,
    work: np.ndarray,
    lanes: np.ndarray,
) -> None:
    """Find the points from which the surface's normal leads to the charge's nodes of the `contact`s (k,).

    Parameters
    ----------
    slave, charge_position, charge_velocity : the contacts' nodes; places of nodes (m) and, not used here but soon after
        and therefore brought near, their velocities.
    position : (rows, 3) m, of the casing's interface nodes.
    face : (k,) int32, faces from which each contact's point is followed; where they lie now, in place.
    point : (contacts, 2), their coordinates -1 to 1 in these faces, likewise.
    found : (k, 6), see `GAP`.
    work : (POINT_ROWS LANES,), lanes : (4, LANES) int64, scratch.
    """
    faces, neighbour, corner = surface.faces, surface.neighbour, surface.corner
    known, vector = surface.known, surface.vector
    # What each lane is at: the place in `contact`, faces so far, steps in this one, whether it is held on an edge.
    at, walks, steps, clamped = lanes[0], lanes[1], lanes[2], lanes[3]
    for k in range(work.size):
        work[k] = 0.0
    taken, busy = 0, 0
    places, velocities = address(charge_position), address(charge_velocity)
    for lane in range(LANES):
        at[lane], clamped[lane] = -1, 2  # 2: to be given its first contact
        busy += 1
    while busy > 0:
        _improve(work)
        for lane in range(LANES):
            k, done = at[lane], clamped[lane] != 0
            if k < 0 and not done:
                continue
            if not done:
                xi, eta = work[_NEW_XI * LANES + lane], work[_NEW_ETA * LANES + lane]
                work[_XI * LANES + lane], work[_ETA * LANES + lane] = xi, eta
                steps[lane] += 1
                if not work[_CHANGE * LANES + lane] < _CLOSE and steps[lane] < _NEWTON:
                    continue
                allowed = 1.0 + work[_EXCESS * LANES + lane]
                done = max(abs(xi), abs(eta)) <= allowed
                if not done:
                    other = _across(face[k], xi, eta, allowed, neighbour, known)
                    last = walks[lane] == _WALKS - 1
                    work[_EXCESS * LANES + lane] *= _LARGER
                    walks[lane] += 1
                    steps[lane] = 0
                    if other >= 0 and not last:
                        face[k] = other
                        _load_face(lane, other, 0.0, 0.0, faces, corner, position, vector, work)
                        continue
                    # The edge of the surface: the point is held on it.
                    work[_XI * LANES + lane] = min(max(xi, -1.0), 1.0)
                    work[_ETA * LANES + lane] = min(max(eta, -1.0), 1.0)
                    if not last:
                        clamped[lane] = 1
                        continue
            if k >= 0:
                c = contact[k]
                point[c, 0], point[c, 1] = work[_XI * LANES + lane], work[_ETA * LANES + lane]
                found[k, GAP], found[k, SIZE] = work[_GAP * LANES + lane], work[_SIZE * LANES + lane]
                tx, ty, tz = load_vector(work, _ALONG, lane)
                found[k, BEYOND] = np.sqrt(tx * tx + ty * ty + tz * tz) if clamped[lane] == 1 else 0.0
                for i in range(3):
                    found[k, NORMAL + i] = work[(_NORMAL + i) * LANES + lane]
            at[lane], walks[lane], steps[lane], clamped[lane] = -1, 0, 0, 0
            if taken == contact.size:
                busy -= 1
                continue
            at[lane], work[_EXCESS * LANES + lane] = taken, _TIE
            # The nodes lie scattered: what comes later is fetched now.
            later = _NODE_BYTES * np.uint64(slave[contact[min(taken + _AHEAD, contact.size - 1)]])
            prefetch(places + later)
            prefetch(velocities + later)
            c, node = contact[taken], slave[contact[taken]]
            for i in range(3):
                work[(_NODE + i) * LANES + lane] = charge_position[node, i]
            _load_face(lane, face[taken], point[c, 0], point[c, 1], faces, corner, position, vector, work)
            taken += 1
