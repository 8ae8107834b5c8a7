"""Facets: the point of one at which a node lies, by one Newton iteration for edges, quadrilaterals and closest points.

A smooth surface has a normal interpolated between those of its facets' corners, so that it is continuous from facet to
facet. A node lies at the point from which the normal there leads to it (`find_point`), and is followed from facet to
facet as it slides. A node that collides lies at the closest point of a facet, whose own normal counts
(`closest_point`): that is the same iteration with another normal.

An edge of a meridian from a to b is a facet whose second coordinate does not count; what lies to its right is outward.
"""

from __future__ import annotations

from typing import NamedTuple, TypeAlias

import numpy as np

from burst_fenicsx.kernels.contact.law import add_product, product, vector_product
from burst_fenicsx.kernels.lanes import block_kernel, inlined_kernel, lane_function
from burst_fenicsx.kernels.vectors.tensors import Vector

_NEWTON, _WALKS, _CLOSEST = 12, 10, 4
_CLOSE = 1e-9  # last change of a facet's coordinates: by quadratic convergence the error left is round-off
_TIE = 1e-12  # by which a point may lie over an edge; larger with every facet, so that the search ends
_LARGER = 16.0


class Surface(NamedTuple):
    """Facets on which a charge may slide; a group is a corner node with those of its facets that are smooth together.

    Neighbours are those across the edge from corner k to k + 1; of an edge of a meridian, those beyond its second end
    (k = 1) and its first (k = 3).
    """

    facets: np.ndarray  # (facets, 4 or 2) int32 rows of nodes, outward from the casing
    neighbour: np.ndarray  # (facets, 4) int32; -1 across a crease and at a rim
    hollow: np.ndarray  # (facets, 4) int32, likewise across a crease that is hollow towards the charge; else -1
    corner: np.ndarray  # (facets, 4 or 2) int32, group of each corner
    first: np.ndarray  # (groups + 1,) int32 into `member`
    member: np.ndarray  # int32, facets of each group
    mirrors: np.ndarray  # (groups, planes, 3) normals of the planes of symmetry in which the group's node lies, or zero
    known: np.ndarray  # (facets,) bool, whether this rank knows the positions of the facet and of those around it
    area: np.ndarray  # (facets, 3) area vectors (m2), of edges their lengths (m), now
    vector: np.ndarray  # (groups, 3) their sums over each group's facets, now


_Point: TypeAlias = tuple[Vector, Vector, Vector, Vector]


@lane_function
def _row(values: np.ndarray, row: int) -> Vector:
    return values[row, 0], values[row, 1], values[row, 2]


@lane_function
def weigh(corner: int, corners: int, xi: float, eta: float) -> float:
    """Weight of a facet's corner at a point of it (Eq. 17)."""
    s = -1.0 if corner == 0 or corner == 3 else 1.0
    if corners == 2:
        return 0.5 * (1.0 + s * xi)
    t = -1.0 if corner < 2 else 1.0
    return 0.25 * (1.0 + s * xi) * (1.0 + t * eta)


@lane_function
def _tangents(nodes: np.ndarray, xi: float, eta: float, position: np.ndarray) -> tuple[Vector, Vector, Vector]:
    """Derivatives by xi and by eta of the place in a facet of the given `nodes` (corners,), and the place."""
    p, q = _row(position, np.uint64(nodes[0])), _row(position, np.uint64(nodes[1]))
    if nodes.size == 2:
        along = add_product((0.5 * q[0], 0.5 * q[1], 0.5 * q[2]), -0.5, p)
        middle = add_product((0.5 * q[0], 0.5 * q[1], 0.5 * q[2]), 0.5, p)
        return along, (0.0, 1.0, 0.0), add_product(middle, xi, along)
    r, s = _row(position, np.uint64(nodes[2])), _row(position, np.uint64(nodes[3]))
    below, above = 0.25 * (1.0 - eta), 0.25 * (1.0 + eta)
    left, right = 0.25 * (1.0 - xi), 0.25 * (1.0 + xi)
    zero = (0.0, 0.0, 0.0)
    pq, sr = add_product(q, -1.0, p), add_product(r, -1.0, s)
    ps, qr = add_product(s, -1.0, p), add_product(r, -1.0, q)
    a = add_product(add_product(zero, below, pq), above, sr)
    b = add_product(add_product(zero, left, ps), right, qr)
    x = add_product(add_product(zero, left * (1.0 - eta), p), right * (1.0 - eta), q)
    return a, b, add_product(add_product(x, right * (1.0 + eta), r), left * (1.0 + eta), s)


@lane_function
def _newton(x: Vector, a: Vector, b: Vector, place: Vector, n: Vector) -> tuple[float, Vector, float, float]:
    """Gap (m) of a node at `x` over a point, its offset along the surface (m), and the change of xi and eta.

    `a`, `b` are the tangents there, `n` the unit normal. The gap is that at the changed point, to second order.
    """
    r = add_product(x, -1.0, place)
    gap = product(r, n)
    along = add_product(r, -gap, n)
    an, bn = product(a, n), product(b, n)
    a, b = add_product(a, -an, n), add_product(b, -bn, n)
    aa, ab, bb, at, bt = product(a, a), product(a, b), product(b, b), product(a, along), product(b, along)
    determinant = aa * bb - ab * ab
    inverse = 1.0 / determinant if determinant > 1e-12 * aa * bb else 0.0
    d_xi, d_eta = inverse * (bb * at - ab * bt), inverse * (aa * bt - ab * at)
    return gap - an * d_xi - bn * d_eta, along, d_xi, d_eta


@lane_function
def _unit(v: Vector) -> tuple[Vector, float]:
    size = np.sqrt(product(v, v))
    inverse = 1.0 / size if size > 0.0 else 0.0
    return (inverse * v[0], inverse * v[1], inverse * v[2]), size


@lane_function
def _across(facet: int, xi: float, eta: float, allowed: float, onward: np.ndarray, known: np.ndarray) -> int:
    """Facet across the edge that a point lies beyond most, by more than `allowed`, and that leads on; else -1."""
    best, farthest = -1, allowed
    for edge in range(4):
        over = -eta if edge == 0 else (xi if edge == 1 else (eta if edge == 2 else -xi))
        other = onward[facet, edge]
        if over > farthest and other >= 0 and known[other]:
            best, farthest = other, over
    return best


@lane_function
def _improve(
    x: Vector, facet: int, xi: float, eta: float, surface: Surface, position: np.ndarray
) -> tuple[float, Vector, float, Vector, float, float]:
    """Gap, normal, size of the interpolated area vector, offset along the surface, change of xi and eta."""
    nodes, corner = surface.facets[facet], surface.corner[facet]
    a, b, place = _tangents(nodes, xi, eta, position)
    v = (0.0, 0.0, 0.0)
    for k in range(nodes.size):
        v = add_product(v, weigh(k, nodes.size, xi, eta), _row(surface.vector, np.uint64(corner[k])))
    n, size = _unit(v)
    gap, along, d_xi, d_eta = _newton(x, a, b, place, n)
    return gap, n, size, along, d_xi, d_eta


@inlined_kernel
def find_point(
    x: Vector, facet: int, xi: float, eta: float, single: bool, surface: Surface, position: np.ndarray
) -> tuple[int, float, float, float, Vector, float, float]:
    """Follow a node at `x` from a point of a facet to that from which the surface's normal leads to it.

    A `single` contact of its node goes on through hollow creases. `position` (rows, 3) in m.

    Returns
    -------
    Facet, xi, eta; gap (m), unit normal; how far the node lies beyond the surface's rim (m); size of the interpolated
    area vector (m2, of edges m).
    """
    allowed, walk = _TIE, 1
    while True:
        for _ in range(_NEWTON):
            gap, n, size, along, d_xi, d_eta = _improve(x, facet, xi, eta, surface, position)
            xi, eta = min(max(xi + d_xi, -4.0), 4.0), min(max(eta + d_eta, -4.0), 4.0)
            if abs(d_xi) + abs(d_eta) < _CLOSE:
                break
        if max(abs(xi), abs(eta)) <= 1.0 + allowed:
            return facet, xi, eta, gap, n, 0.0, size
        other = _across(facet, xi, eta, 1.0 + allowed, surface.neighbour, surface.known)
        if other < 0 and single:
            other = _across(facet, xi, eta, 1.0 + allowed, surface.hollow, surface.known)
        allowed *= _LARGER
        walk += 1
        if other < 0 or walk == _WALKS:
            break
        facet, xi, eta = other, 0.0, 0.0
    # The rim of the surface: the point is held on it.
    xi, eta = min(max(xi, -1.0), 1.0), min(max(eta, -1.0), 1.0)
    _, n, size, along, _, _ = _improve(x, facet, xi, eta, surface, position)
    place = _tangents(surface.facets[facet], xi, eta, position)[2]
    gap = product(add_product(x, -1.0, place), n)
    return facet, xi, eta, gap, n, np.sqrt(product(along, along)), size


@block_kernel
def closest_point(x: Vector, nodes: np.ndarray, position: np.ndarray) -> tuple[float, float, Vector, Vector]:
    """Closest point to `x` of the bilinear facet of `nodes` (4,): xi and eta within [-1, 1], place, unit normal."""
    xi, eta = 0.0, 0.0
    a, b, place = _tangents(nodes, xi, eta, position)
    n, _ = _unit(vector_product(a, b))
    for _ in range(_CLOSEST):
        _, _, d_xi, d_eta = _newton(x, a, b, place, n)
        last_xi, last_eta = xi, eta
        xi, eta = min(max(xi + d_xi, -1.0), 1.0), min(max(eta + d_eta, -1.0), 1.0)
        if xi == last_xi and eta == last_eta:
            break
        a, b, place = _tangents(nodes, xi, eta, position)
        n, _ = _unit(vector_product(a, b))
    return xi, eta, place, n


@lane_function
def _area_vector(nodes: np.ndarray, position: np.ndarray) -> Vector:
    """Area vector of a facet of `nodes` (corners,) in m2; of an edge its length times its normal (m)."""
    p, q = _row(position, np.uint64(nodes[0])), _row(position, np.uint64(nodes[1]))
    if nodes.size == 2:
        return q[2] - p[2], 0.0, p[0] - q[0]
    one = add_product(_row(position, np.uint64(nodes[2])), -1.0, p)
    other = add_product(_row(position, np.uint64(nodes[3])), -1.0, q)
    u = vector_product(one, other)
    return 0.5 * u[0], 0.5 * u[1], 0.5 * u[2]


@block_kernel
def area_vectors(
    first: int, last: int, chosen: np.ndarray, facets: np.ndarray, position: np.ndarray, area: np.ndarray
) -> None:
    """Area vectors, into `area` (facets, 3), of the `chosen` facets from `first` to `last` that have nodes."""
    for k in range(first, last):
        facet = chosen[k]
        if facets[facet, 0] >= 0:
            area[facet, 0], area[facet, 1], area[facet, 2] = _area_vector(facets[facet], position)


@block_kernel
def group_vectors(first: int, last: int, chosen: np.ndarray, surface: Surface) -> None:
    """Sum the facets' area vectors over the `chosen` groups from `first` to `last`, into `surface.vector`.

    In a plane of symmetry those of the image's facets belong to it: the sum lies in the plane, twice as long.
    """
    for k in range(first, last):
        group, v = chosen[k], (0.0, 0.0, 0.0)
        for at in range(surface.first[group], surface.first[group + 1]):
            v = add_product(v, 1.0, _row(surface.area, np.uint64(surface.member[at])))
        for plane in range(surface.mirrors.shape[1]):
            n = (
                surface.mirrors[group, plane, 0],
                surface.mirrors[group, plane, 1],
                surface.mirrors[group, plane, 2],
            )
            if product(n, n) > 0.0:
                v = add_product(v, -product(v, n), n)
                v = add_product(v, 1.0, v)
        for i in range(3):
            surface.vector[group, i] = v[i]
