"""Surfaces that collide: nodes of one pushed out of the facets of another (Eqs. 16-18).

Every node finds, of each round near it, the facet that it has entered and the force between them, side by side. Both
surfaces take their turn as nodes and as facets.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.constants import UNLOADED_TIME
from burst_fenicsx.kernels.contact.facets import closest_point, weigh
from burst_fenicsx.kernels.contact.law import Law, add_product, product
from burst_fenicsx.kernels.contact.pairs import Pairs, Rows, relative_motion, release, set_spring
from burst_fenicsx.kernels.lanes import block_kernel, kernel, lane_function
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.tensors import Vector

_ENTRY = 1.5  # a node newly met lies no deeper than it can have come in this many steps
_DEEPEST = 0.5  # of the facet's initial edge: a node that lies deeper has lost its facet
_OFF_RIM = 1.5  # of its depth: a node farther from the facet than this is not under it
_BESIDE = 0.1  # of its depth: a node off a rim by less still counts as under the facet
_LATE = 0.1  # of the facet's initial edge: a node that came in beside one is taken up where it lies no deeper
_OPPOSED = -0.2  # cosine between a node's own normal and that of a facet that it may have entered
_TIE = 1e-9  # distances that differ by less, relatively, are one
_ALIKE = 1e-6  # cosines, and places over the facet's initial edge, that differ by less are one
# Of the facet's initial edge: so much of a depth that was there before contact stays unloaded. Nodes of longer steps
# than contact's come in by so little at once, and to load that would make energy.
_KEPT = 0.01
_LIKE = 0.5  # cosine above which a facet looks like the one that a node touched before


class Candidates(NamedTuple):
    """The facets that a pair's node may meet before the next search: those of one round. A node has a pair with each.

    A node between several rounds is pushed by each.
    """

    other: np.ndarray  # (pairs,) int32, the round
    same: np.ndarray  # (pairs,) bool, whether it is the node's own
    outward: np.ndarray  # (pairs, 3) unit normal of the node's own surface at the last search; of an inner node zero
    unloaded: np.ndarray  # (pairs,) m, the part of the depth that presses nothing
    first: np.ndarray  # (pairs + 1,) int64 into `candidate`
    candidate: np.ndarray  # int32, facets
    facets: np.ndarray  # (facets, 4) int32 rows
    edge: np.ndarray  # (facets,) m, square root of the initial area
    near: np.ndarray  # (near facets,) int32, those in `candidate`, each once
    ball: np.ndarray  # (facets, 5) of `near`, in this step: the centre (m), radius of a ball around it that holds the
    # facet (m), largest speed of a corner (m/s)


@kernel
def collide(law: Law, pairs: Pairs, seen: Candidates, rows: Rows) -> None:
    """Find each pair's facet and the force between it and the node (N)."""
    on_threads(seen.near.size, _bound_some, (seen, rows))
    on_threads(pairs.node.size, _collide_some, (law, pairs, seen, rows))


@block_kernel
def _bound_some(first: int, last: int, seen: Candidates, rows: Rows) -> None:
    ball, x, v = seen.ball, rows.position, rows.velocity
    for k in range(first, last):
        facet = seen.near[k]
        nodes = seen.facets[facet]
        for i in range(3):
            ball[facet, i] = 0.5 * (x[nodes[0], i] + x[nodes[2], i])
        size, speed = 0.0, 0.0
        for n in nodes:
            away, fast = 0.0, 0.0
            for i in range(3):
                away += (x[n, i] - ball[facet, i]) ** 2
                fast += v[n, i] ** 2
            size, speed = max(size, away), max(speed, fast)
        ball[facet, 3], ball[facet, 4] = np.sqrt(size), np.sqrt(speed)


@block_kernel
def _collide_some(first: int, last: int, law: Law, pairs: Pairs, seen: Candidates, rows: Rows) -> None:
    for k in range(first, last):
        node = np.uint64(pairs.node[k])
        x = (rows.position[node, 0], rows.position[node, 1], rows.position[node, 2])
        v = (rows.velocity[node, 0], rows.velocity[node, 1], rows.velocity[node, 2])
        touching, last_depth = pairs.facet[k] >= 0, -pairs.gap[k]
        last_normal = (pairs.normal[k, 0], pairs.normal[k, 1], pairs.normal[k, 2])
        speed = np.sqrt(product(v, v))
        best, nearest, unloaded, gap = -1, np.inf, 0.0, 0.0
        best_xi, best_eta, best_normal = 0.0, 0.0, last_normal
        for at in range(seen.first[k], seen.first[k + 1]):
            facet = seen.candidate[at]
            # Most are rejected here: too far, or too deep to have come in by this facet.
            edge, reach = seen.edge[facet], _DEEPEST * seen.edge[facet]
            deepest = _ENTRY * law.step * (speed + seen.ball[facet, 4])
            if touching:
                deepest += last_depth + _LATE * edge
            elif not seen.same[k]:
                deepest += _LATE * edge
            within = (1.0 + _TIE) * min(_OFF_RIM * min(deepest, reach), nearest)
            if _lies_beyond(within, x, facet, seen, rows.position):
                continue
            xi, eta, place, normal = closest_point(x, seen.facets[facet], rows.position)
            away = add_product(x, -1.0, place)
            distance, depth = np.sqrt(product(away, away)), -product(away, normal)
            # Off the facet's rim by more than it lies behind it: not under this facet at all.
            if depth <= 0.0 or depth > reach or distance > _OFF_RIM * depth or distance > (1.0 + _TIE) * nearest:
                continue
            if distance >= (1.0 - _TIE) * nearest and not _comes_first(k, facet, best, normal, best_normal, seen):
                continue
            _place(k, facet, xi, eta, normal, -depth, pairs)
            moved = relative_motion(k, law.step, pairs, seen.facets, rows)
            free = _unloaded_depth(k, law, edge, depth, normal, moved, touching, last_depth, last_normal, seen)
            if free < np.inf:
                best, nearest, unloaded, gap = facet, distance, free, -depth
                best_xi, best_eta, best_normal = xi, eta, normal
        if (
            best >= 0
            and max(abs(best_xi), abs(best_eta)) >= 1.0
            and _outside_beside(k, x, nearest, seen, rows.position)
        ):
            best = -1
        if best >= 0:
            _place(k, best, best_xi, best_eta, best_normal, gap, pairs)
            seen.unloaded[k] = unloaded
            set_spring(k, law, unloaded, pairs, seen.facets, rows)
        else:
            seen.unloaded[k] = 0.0
            release(k, pairs)


@lane_function
def _place(k: int, facet: int, xi: float, eta: float, normal: Vector, gap: float, pairs: Pairs) -> None:
    """Put a pair's node where it lies on a facet."""
    pairs.facet[k], pairs.gap[k] = facet, gap
    pairs.point[k, 0], pairs.point[k, 1] = xi, eta
    for i in range(3):
        pairs.normal[k, i] = normal[i]
    for corner in range(4):
        pairs.weight[k, corner] = weigh(corner, 4, xi, eta)


@lane_function
def _lies_beyond(distance: float, x: Vector, facet: int, seen: Candidates, position: np.ndarray) -> bool:
    """Whether a node at `x` is farther than `distance` (m) from a facet, as far as its ball and its corners show.

    No point of the facet lies farther along the way from its centre to the node than some corner.
    """
    ball = seen.ball
    away = (x[0] - ball[facet, 0], x[1] - ball[facet, 1], x[2] - ball[facet, 2])
    square = product(away, away)
    if square > (ball[facet, 3] + distance) ** 2:
        return True
    farthest = -np.inf
    for n in seen.facets[facet]:
        corner = (position[n, 0] - ball[facet, 0], position[n, 1] - ball[facet, 1], position[n, 2] - ball[facet, 2])
        farthest = max(farthest, product(away, corner))
    apart = square - farthest
    return apart > 0.0 and apart**2 > distance**2 * square


@lane_function
def _comes_first(k: int, facet: int, best: int, normal: Vector, best_normal: Vector, seen: Candidates) -> bool:
    """Whether of two equally near facets `facet` is taken and not `best`: by geometry alone.

    The one that looks more towards the node's own surface; then the one whose centre comes first by x, y, z.
    """
    facing = 0.0
    for i in range(3):
        facing += seen.outward[k, i] * (normal[i] - best_normal[i])
    if abs(facing) > _ALIKE:
        return facing < 0.0
    for i in range(3):
        apart = seen.ball[facet, i] - seen.ball[best, i]
        if abs(apart) > _ALIKE * seen.edge[facet]:
            return apart < 0.0
    return False


@lane_function
def _unloaded_depth(
    k: int,
    law: Law,
    edge: float,
    depth: float,
    normal: Vector,
    moved: Vector,
    touching: bool,
    last_depth: float,
    last_normal: Vector,
    seen: Candidates,
) -> float:
    """The part of a node's depth (m) behind a facet that presses nothing; infinite where it does not touch this facet.

    A spring may at once take up only what the node has sunk in since it touched. What it lies deeper, because it came
    in beside the facet or has passed to another one, is loaded within microseconds.

    An inner node has no normal of its own (`outward` is zero): it may enter any facet of another round from the
    front, and is taken up late only while it moves deeper.
    """
    outward = (seen.outward[k, 0], seen.outward[k, 1], seen.outward[k, 2])
    approach, facing, inner = -product(moved, normal), product(outward, normal), product(outward, outward) == 0.0
    if touching and product(last_normal, normal) > _LIKE:
        sunk = last_depth + _ENTRY * np.sqrt(product(moved, moved))
        if depth <= sunk + _LATE * edge:
            held, kept = seen.unloaded[k], _KEPT * edge
            if held > kept:
                held = max(held * (1.0 - law.step / UNLOADED_TIME), kept)
            return max(min(held, depth), depth - sunk)
    entered = _ENTRY * max(approach, 0.0)
    if seen.same[k]:
        # Within a round the far side of a thin wall looks the same: the node must have been in front a step ago.
        return 0.0 if depth <= entered else np.inf
    if depth <= entered and (facing < 0.0 or inner):
        return 0.0
    late = (facing < _OPPOSED or (inner and approach > 0.0)) and depth <= _LATE * edge
    return max(depth - entered, 0.0) if late else np.inf


@block_kernel
def _outside_beside(k: int, x: Vector, nearest: float, seen: Candidates, position: np.ndarray) -> bool:
    """Whether a node behind a facet but off its rim stands in front of a nearer facet of the same round."""
    for at in range(seen.first[k], seen.first[k + 1]):
        facet = seen.candidate[at]
        if _lies_beyond((1.0 + _TIE) * nearest, x, facet, seen, position):
            continue
        _, _, place, normal = closest_point(x, seen.facets[facet], position)
        away = add_product(x, -1.0, place)
        if product(away, normal) > _BESIDE * nearest and product(away, away) < nearest**2:
            return True
    return False
