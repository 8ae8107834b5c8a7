"""Pairs of a node and a facet: their state, the rows of the nodes, and the one sum and tally of all of them.

A facet is a quadrilateral of four nodes, in the meridian an edge of two; a rigid plane or a plane of symmetry is a
facet without nodes, and so without mass. What a pair's node gets, the facet's nodes give (Eq. 17).
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.constants import EVEN_SHARING
from burst_fenicsx.kernels.contact.law import Law, add_product, spring
from burst_fenicsx.kernels.lanes import block_kernel, kernel, lane_function
from burst_fenicsx.kernels.threads import on_threads
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.tensors import Vector


class Rows(NamedTuple):
    """The nodes that contact may push, as rows of arrays of its own."""

    local: np.ndarray  # (rows,) int32 local node, -1 where it is not here
    mass: np.ndarray  # (rows,) kg
    faster: np.ndarray  # (rows,) bool, whether the node takes several steps in one of contact
    position: np.ndarray  # (rows, 3) m
    velocity: np.ndarray  # (rows, 3) m/s, the mean one over contact's step
    load: np.ndarray  # (rows,) what the pairs of the last step lay on the node, see `add_pairs`
    sums: np.ndarray  # (rows, 4) N and the load, of this step


class Pairs(NamedTuple):
    """Pairs of a node and a facet that it may meet, and the state of each pair's contact."""

    node: np.ndarray  # (pairs,) int32 row
    facet: np.ndarray  # (pairs,) int32, where the node lies; -1 where it meets none
    point: np.ndarray  # (pairs, 2) coordinates -1 to 1 in it
    weight: np.ndarray  # (pairs, corners) of the facet's nodes (Eq. 17)
    normal: np.ndarray  # (pairs, 3) of the facet there, towards the node's side
    gap: np.ndarray  # (pairs,) m, negative behind the facet
    stiffness: np.ndarray  # (pairs,) N/m of the last step, 0 where nothing touched
    slip: np.ndarray  # (pairs, 3) m, tangential displacement that the spring holds
    gas: np.ndarray  # (pairs,) N, along the normal
    force: np.ndarray  # (pairs, 3) N of the spring on the node
    reduced: np.ndarray  # (pairs,) kg, reduced mass of surfaces that collide; of charges on their casings 0
    energies: np.ndarray  # (pairs, 2) J: stored in the spring, friction in this step


def no_pairs(node: np.ndarray, corners: int) -> Pairs:
    """Pairs of nodes, given as rows (pairs,), that touch nothing."""
    count = len(node)
    return Pairs(
        node=node.astype(np.int32),
        facet=np.full(count, -1, dtype=np.int32),
        point=np.zeros((count, 2)),
        weight=np.zeros((count, corners)),
        normal=np.zeros((count, 3)),
        gap=np.zeros(count),
        stiffness=np.zeros(count),
        slip=np.zeros((count, 3)),
        gas=np.zeros(count),
        force=np.zeros((count, 3)),
        reduced=np.zeros(count),
        energies=np.zeros((count, 2)),
    )


@kernel
def gather_rows(
    chosen: np.ndarray, step: float, position: np.ndarray, velocity: np.ndarray, rounding: float, rows: Rows
) -> float:
    """Take over the motion of the `chosen` rows' nodes since the last time, a `step` (s) ago; clear their sums.

    `position` and `velocity` (nodes, 3) are those of the local nodes. A node that takes several steps in one of contact
    has its mean velocity; one of longer steps moves at once by what it moves in several of contact's. Returned is the
    work (J) of the forces of then in half of the motion, exact: each row's is rounded by `quantise`.
    """
    work = np.empty(chosen.size)
    on_threads(chosen.size, _gather_some, (chosen, step, position, velocity, rounding, rows, work))
    return work.sum()


@block_kernel
def _gather_some(
    first: int,
    last: int,
    chosen: np.ndarray,
    step: float,
    position: np.ndarray,
    velocity: np.ndarray,
    rounding: float,
    rows: Rows,
    work: np.ndarray,
) -> None:
    for k in range(first, last):
        row = np.uint64(chosen[k])
        work[k] = gather_row(row, step, position, velocity, rounding, rows)


@lane_function
def gather_row(row: int, step: float, position: np.ndarray, velocity: np.ndarray, rounding: float, rows: Rows) -> float:
    """As `gather_rows`, of one row."""
    node, power = np.uint64(rows.local[row]), 0.0
    for i in range(3):
        now = position[node, i]
        mean = (now - rows.position[row, i]) / step if rows.faster[row] and step > 0.0 else velocity[node, i]
        power += rows.sums[row, i] * mean
        rows.position[row, i], rows.velocity[row, i], rows.sums[row, i] = now, mean, 0.0
    rows.load[row], rows.sums[row, 3] = rows.sums[row, 3], 0.0
    return quantise(0.5 * step * power, rounding)


@kernel
def give_rows(
    chosen: np.ndarray, step: float, fraction: float, rounding: float, rows: Rows, force: np.ndarray
) -> float:
    """Add `fraction` of the sums of the `chosen` rows to `force` (nodes, 3) in N.

    Returned is their work (J) in half of the last motion, as of `gather_rows`.
    """
    work = np.empty(chosen.size)
    on_threads(chosen.size, _give_some, (chosen, step, fraction, rounding, rows, force, work))
    return work.sum()


@block_kernel
def _give_some(
    first: int,
    last: int,
    chosen: np.ndarray,
    step: float,
    fraction: float,
    rounding: float,
    rows: Rows,
    force: np.ndarray,
    work: np.ndarray,
) -> None:
    for k in range(first, last):
        work[k] = give_row(np.uint64(chosen[k]), step, fraction, rounding, rows, force)


@lane_function
def give_row(row: int, step: float, fraction: float, rounding: float, rows: Rows, force: np.ndarray) -> float:
    """As `give_rows`, of one row."""
    node, power = np.uint64(rows.local[row]), 0.0
    for i in range(3):
        power += rows.sums[row, i] * rows.velocity[row, i]
        force[node, i] += fraction * rows.sums[row, i]
    return quantise(0.5 * step * power, rounding)


@lane_function
def relative_motion(k: int, step: float, pairs: Pairs, facets: np.ndarray, rows: Rows) -> Vector:
    """How far (m) a pair's node has moved in a step (s) against the point of its facet (Eqs. 16-17)."""
    node, v = np.uint64(pairs.node[k]), rows.velocity
    moved = (v[node, 0], v[node, 1], v[node, 2])
    for corner in range(facets.shape[1]):
        other = np.uint64(facets[pairs.facet[k], corner])
        moved = add_product(moved, -pairs.weight[k, corner], (v[other, 0], v[other, 1], v[other, 2]))
    return step * moved[0], step * moved[1], step * moved[2]


@lane_function
def _stiffness(k: int, law: Law, pairs: Pairs, facets: np.ndarray, rows: Rows) -> float:
    """Stiffness (N/m) that the step bears of a pair that meets and leaves surfaces; its reduced mass.

    Where several nodes share a facet its springs are softened. By Jensen's inequality the highest squared frequency of
    all is at most twice the largest load.
    """
    node = np.uint64(pairs.node[k])
    if facets.shape[1] == 0:
        return law.max_squared_frequency * rows.mass[node]
    inverse, load = 1.0 / rows.mass[node], rows.load[node]
    for corner in range(facets.shape[1]):
        other = np.uint64(facets[pairs.facet[k], corner])
        inverse += pairs.weight[k, corner] ** 2 / rows.mass[other]
        load = max(load, rows.load[other])
    pairs.reduced[k] = 1.0 / inverse
    return 0.5 * law.max_squared_frequency * pairs.reduced[k] / max(load, EVEN_SHARING)


@lane_function
def set_spring(k: int, law: Law, unloaded: float, pairs: Pairs, facets: np.ndarray, rows: Rows) -> None:
    """Spring of a pair of surfaces that collide: friction, neither gas nor bond (Eqs. 16-18).

    Of the depth behind the facet `unloaded` (m) presses nothing.
    """
    normal = (pairs.normal[k, 0], pairs.normal[k, 1], pairs.normal[k, 2])
    slip = (pairs.slip[k, 0], pairs.slip[k, 1], pairs.slip[k, 2])
    force, stiffness, slip, stored, heat, _ = spring(
        0.0, 0.0, 0.0, law.friction, np.inf, pairs.gap[k] + unloaded, _stiffness(k, law, pairs, facets, rows), normal,
        relative_motion(k, law.step, pairs, facets, rows), slip, pairs.stiffness[k],
    )  # fmt: skip
    pairs.stiffness[k] = stiffness
    pairs.energies[k, 0], pairs.energies[k, 1] = stored, heat
    for i in range(3):
        pairs.force[k, i], pairs.slip[k, i] = force[i], slip[i]


@lane_function
def release(k: int, pairs: Pairs) -> None:
    """Part a pair from its facet: what the spring held tangentially is heat."""
    square = 0.0
    for i in range(3):
        square += pairs.slip[k, i] ** 2
        pairs.slip[k, i], pairs.force[k, i] = 0.0, 0.0
    pairs.energies[k, 0], pairs.energies[k, 1] = 0.0, 0.5 * pairs.stiffness[k] * square
    pairs.facet[k], pairs.gap[k], pairs.stiffness[k] = -1, 0.0, 0.0


@kernel
def near_plane(normal: np.ndarray, level: float, local: np.ndarray, position: np.ndarray, pairs: Pairs) -> np.ndarray:
    """Pairs (k,) int32 whose nodes lie lower than `level` (m) along a unit `normal` (3,), or touch the plane.

    `position` (nodes, 3) is that of the pairs' `local` nodes (pairs,). The others keep no energy.
    """
    near, count = np.empty(local.size, dtype=np.int32), 0
    for k in range(local.size):
        node, height = np.uint64(local[k]), 0.0
        for i in range(3):
            height += position[node, i] * normal[i]
        if height < level or pairs.facet[k] >= 0:
            near[count] = k
            count += 1
        else:
            pairs.energies[k, 0] = pairs.energies[k, 1] = 0.0
    return near[:count].copy()


@kernel
def press_on_plane(
    law: Law,
    normal: np.ndarray,
    level: float,
    near: np.ndarray,
    inner: int,
    roundings: tuple[float, float, float],
    pairs: Pairs,
    plane: np.ndarray,
    rows: Rows,
) -> tuple[float, Vector, float, float]:
    """Springs of the pairs `near` (k,) a plane: a facet of no nodes, `plane` (1, 0), with the unit `normal` (3,).

    `level` (m) is the normal times a point of the plane; pairs from `inner` on are of inner nodes. Their forces (N) are
    added to the sums of the rows as by `add_pairs`; a plane lays no load on a node. Returned are friction (J) in this
    step and the force (N) of the plane, exact sums by the other two constants of `quantise`, and the deepest of all
    pairs and of those of inner nodes (m).
    """
    rounding, plane_rounding, work_rounding = roundings
    friction, x, y, z, deepest, deepest_inner = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for k in near:
        node, gap = np.uint64(pairs.node[k]), -level
        for i in range(3):
            gap += rows.position[node, i] * normal[i]
        if gap < 0.0:
            pairs.facet[k], pairs.gap[k] = 0, gap
            for i in range(3):
                pairs.normal[k, i] = normal[i]
            set_spring(k, law, 0.0, pairs, plane, rows)
            for i in range(3):
                rows.sums[node, i] += quantise(pairs.force[k, i], rounding)
            x += quantise(pairs.force[k, 0], plane_rounding)
            y += quantise(pairs.force[k, 1], plane_rounding)
            z += quantise(pairs.force[k, 2], plane_rounding)
            deepest = max(deepest, -gap)
            deepest_inner = max(deepest_inner, -gap) if k >= inner else deepest_inner
        elif pairs.facet[k] >= 0:
            release(k, pairs)
        else:
            pairs.energies[k, 1] = 0.0
            continue
        friction += quantise(pairs.energies[k, 1], work_rounding)
    return friction, (x, y, z), deepest, deepest_inner


@block_kernel
def add_pairs(
    pairs: Pairs, facets: np.ndarray, inner: int, roundings: tuple[float, float, float], rows: Rows
) -> tuple[float, float, float]:
    """Add the pairs' forces (N) and loads to the sums of the rows, exactly: the order of pairs does not matter.

    Each term is rounded by `quantise` to a multiple of a power of two, with constants for forces and for loads: the
    node gets what the facet's nodes give, to the last bit. The load of a charge on its casing is its weight, wherever
    it lies on a facet; that of a collision its reduced mass over the node's own.

    Returned are friction (J) in this step, exact by the third constant, and the deepest of all pairs and of those from
    `inner` on (m).
    """
    rounding, load_rounding, work_rounding = roundings
    sums, mass = rows.sums, rows.mass
    friction, deepest, deepest_inner = 0.0, 0.0, 0.0
    for k in range(pairs.node.size):
        friction += quantise(pairs.energies[k, 1], work_rounding)
        facet = pairs.facet[k]
        if facet < 0:
            continue
        if pairs.stiffness[k] > 0.0:
            deepest = max(deepest, -pairs.gap[k])
            deepest_inner = max(deepest_inner, -pairs.gap[k]) if k >= inner else deepest_inner
        node, gas, reduced = np.uint64(pairs.node[k]), pairs.gas[k], pairs.reduced[k]
        force = (
            pairs.force[k, 0] + gas * pairs.normal[k, 0],
            pairs.force[k, 1] + gas * pairs.normal[k, 1],
            pairs.force[k, 2] + gas * pairs.normal[k, 2],
        )
        sums[node, 3] += quantise(reduced / mass[node] if reduced > 0.0 else 1.0, load_rounding)
        for corner in range(facets.shape[1]):
            other, weight = np.uint64(facets[facet, corner]), pairs.weight[k, corner]
            for i in range(3):
                push = quantise(weight * force[i], rounding)
                sums[other, i] -= push
                sums[node, i] += push
            load = weight * reduced / mass[other] if reduced > 0.0 else weight
            sums[other, 3] += quantise(load, load_rounding)
    return friction, deepest, deepest_inner
