"""Sliding of a charge on its casing in the meridian: its edges are facets, and contact acts within the substeps.

Where nodes lie and what both do to each other is `contact.sliding`'s. Forces, masses and areas are those of the whole
ring. The springs' forces are shared by the ends of the edge on which the node lies. The gas's pressure is spread over
all nodes of the line by the integral of both sides' shape functions, a mortar method: an even pressure loads the casing
evenly wherever the charge's nodes have slid to. In three dimensions each node's pressure goes to the corners of its
face alone, which does there; at the axis, where a ring's mass goes to nothing, it would drive a jet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.contact.facets import Surface, area_vectors, group_vectors
from burst_fenicsx.kernels.contact.law import Law
from burst_fenicsx.kernels.contact.pairs import Pairs, Rows, add_pairs, gather_row, give_row
from burst_fenicsx.kernels.contact.sliding import Attached, Bonds, edge_weight, slide, sum_attached
from burst_fenicsx.kernels.lanes import block_kernel, lane_function
from burst_fenicsx.kernels.state import ChargeState, Grid, Nodes, SolidState

SPREAD = 32
"""Most nodes of the line over which the pressure of one node of the charge is spread."""
_MOST_EDGES = 24  # of the line under one edge of the charge
_GAUSS = 0.5 / np.sqrt(3.0)


class Spread(NamedTuple):
    """How the gas's pressure is spread over the line."""

    span: np.ndarray  # (spans, 2) int32, contacts at the ends of each edge of the charge, in the line's direction
    over: np.ndarray  # (contacts, SPREAD) int32 rows of the line that bear the pressure of each contact
    share: np.ndarray  # (contacts, SPREAD) which add up to one
    bearing: np.ndarray  # (contacts,) int32, so many of them


class LineContact(NamedTuple):
    """Contact of a meridian as it acts in the substeps of a macro step, see `contact.ContactForces`."""

    law: Law  # of contact's step; without stiffness (its frequency 0) nothing acts yet
    level: int  # of contact's step, the macro step over 2^level
    front_until: float  # s, until which a front runs or is being reflected
    facets: np.ndarray  # (facets,) int32, all
    groups: np.ndarray  # (groups,) int32, all
    surface: Surface
    pairs: Pairs
    no_gas: np.ndarray  # (contacts,) zeros: the gas's force is spread in another way than the springs'
    bonds: Bonds
    spread: Spread
    attached: Attached
    rows: Rows
    sums: np.ndarray  # (2,) J so far: work of the forces, heat of friction
    deepest: np.ndarray  # (2,) m so far: penetration while a front runs, and after it


@block_kernel
def act_on_line(
    time: float, contact: LineContact, nodes: Nodes, grid: Grid, solid: SolidState, charge: ChargeState
) -> None:
    """Add the forces of contact at `time` (s), at the end of one of its steps, to those of the nodes (N)."""
    law, rows, rounding = contact.law, contact.rows, grid.rounding
    if not law.max_squared_frequency > 0.0:
        return
    for row in range(rows.mass.size):
        contact.sums[0] += gather_row(row, law.step, nodes.position, nodes.velocity, rounding, rows)
    heat, depth = add_line_forces(contact, charge, solid.eroded, rounding)
    after = 0 if time < contact.front_until else 1
    contact.sums[1] += heat
    contact.deepest[after] = max(contact.deepest[after], depth)
    fraction = 1.0 / (1 << contact.level)
    for row in range(rows.mass.size):
        contact.sums[0] += give_row(row, law.step, fraction, rounding, rows, nodes.force)


@block_kernel
def add_line_forces(
    contact: LineContact, charge: ChargeState, eroded: np.ndarray, rounding: float
) -> tuple[float, float]:
    """Find every contact's point and force, advance its state, and add the forces (N) to the sums of the rows.

    `eroded` (slots,) is that of `SolidState`, `rounding` the constant of `quantise` for friction. Returned are friction
    (J) in this step and the deepest contact (m).
    """
    surface, pairs, rows, spread = contact.surface, contact.pairs, contact.rows, contact.spread
    attached, contacts = contact.attached, pairs.node.size
    sum_attached(0, attached.row.size, attached, charge, eroded)
    facets, beside = contact.facets, contact.bonds.beside
    area_vectors(0, facets.size, facets, surface.facets, rows.position, surface.area)
    area_vectors(0, facets.size, facets, beside, rows.position, contact.bonds.area)
    group_vectors(0, contact.groups.size, contact.groups, surface)
    slide(0, contacts, contact.law, surface, pairs, contact.bonds, attached.total, rows)
    spread_pressure(spread, pairs, surface, rows.position)
    springs = Pairs(
        pairs.node, pairs.facet, pairs.point, pairs.weight, pairs.normal, pairs.gap, pairs.stiffness, pairs.slip,
        contact.no_gas, pairs.force, pairs.reduced, pairs.energies,
    )  # fmt: skip
    friction, deepest, _ = add_pairs(springs, surface.facets, contacts, (0.0, 0.0, rounding), rows)
    for c in range(contacts):
        for k in range(spread.bearing[c]):
            for i in range(3):
                push = spread.share[c, k] * pairs.gas[c] * pairs.normal[c, i]
                rows.sums[spread.over[c, k], i] -= push
                rows.sums[pairs.node[c], i] += push
    return friction, deepest


@block_kernel
def spread_pressure(spread: Spread, pairs: Pairs, surface: Surface, position: np.ndarray) -> None:
    """Find over which rows of the line, and in which shares, the pressure of every node of the charge is spread."""
    spread.bearing[:] = 0
    for k in range(spread.span.shape[0]):
        _spread_span(np.int64(spread.span[k, 0]), np.int64(spread.span[k, 1]), spread, pairs, surface, position)
    for c in range(pairs.node.size):
        total = 0.0
        for k in range(spread.bearing[c]):
            total += spread.share[c, k]
        if total > 0.0:
            for k in range(spread.bearing[c]):
                spread.share[c, k] /= total
        else:
            spread.bearing[c] = 0
            for k in range(2):
                _add_share(c, surface.facets[pairs.facet[c], k], pairs.weight[c, k], spread)


@block_kernel
def _spread_span(c: int, d: int, spread: Spread, pairs: Pairs, surface: Surface, position: np.ndarray) -> None:
    """Spread over the line the shares of an edge of the charge between two contacts."""
    a, b = pairs.node[c], pairs.node[d]
    ar, az = position[a, 0], position[a, 2]
    dr, dz = position[b, 0] - ar, position[b, 2] - az
    square = dr * dr + dz * dz
    edge, last = pairs.facet[c], pairs.facet[d]
    s, t = pairs.weight[c, 1], 0.0
    if not _leads_on(edge, last, surface.neighbour) or (edge == last and pairs.weight[d, 1] <= s):
        # Nodes that have changed places or have lost each other press where they are.
        length = np.sqrt(square)
        for k in range(2):
            own = edge_weight(ar, position[b, 0]) * length * pairs.weight[c, k]
            other = edge_weight(position[b, 0], ar) * length * pairs.weight[d, k]
            _add_share(c, surface.facets[edge, k], own, spread)
            _add_share(d, surface.facets[last, k], other, spread)
        return
    for _ in range(_MOST_EDGES + 1):
        until, to = pairs.weight[d, 1] if edge == last else 1.0, 1.0
        if edge != last:
            end = surface.facets[edge, 1]
            to = ((position[end, 0] - ar) * dr + (position[end, 2] - az) * dz) / square
            to = min(max(to, t), 1.0)
        for sign in (-1.0, 1.0):
            at = 0.5 + sign * _GAUSS
            x, y = t + at * (to - t), s + at * (until - s)
            weight = np.pi * abs(ar + x * dr) * (to - t) * np.sqrt(square)
            for k in range(2):
                row, own = surface.facets[edge, k], (y if k == 1 else 1.0 - y) * weight
                _add_share(c, row, (1.0 - x) * own, spread)
                _add_share(d, row, x * own, spread)
        if edge == last:
            return
        edge, s, t = surface.neighbour[edge, 1], 0.0, to


@lane_function
def _leads_on(edge: int, last: int, neighbour: np.ndarray) -> bool:
    """Whether the line leads from an edge on to another over so few that pressure is spread over them."""
    for _ in range(_MOST_EDGES):
        if edge == last:
            return True
        edge = neighbour[edge, 1]
        if edge < 0:
            return False
    return False


@lane_function
def _add_share(c: int, row: int, weight: float, spread: Spread) -> None:
    """Add a weight to a row's share of the pressure of a contact."""
    count = spread.bearing[c]
    for k in range(count):
        if spread.over[c, k] == row:
            spread.share[c, k] += weight
            return
    if count == SPREAD:  # what is beyond the most goes to the last
        spread.share[c, count - 1] += weight
        return
    spread.over[c, count], spread.share[c, count] = row, weight
    spread.bearing[c] = count + 1
