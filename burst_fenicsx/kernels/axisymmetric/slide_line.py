"""Sliding of a charge on its casing in the meridian: the slide surface of `kernels.contact.sliding` as a line.

A node of the charge lies at the point of the line from which the normal there leads to it (`line_points`), and is
followed as it slides. What both do to each other is `contact.slide_law`'s. Forces, masses and areas are those of the
whole ring.

The springs' forces are shared by the ends of the edge on which the node lies. The gas's pressure is spread over all
nodes of the line (`line_pressure`): at the axis, where a ring's mass goes to nothing, a load that is shared by one edge
alone drives a jet.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.axisymmetric.line_points import (
    LineContacts,
    SlideLine,
    boundary_vectors,
    edge_weight,
    find_point,
    relative_velocity,
)
from burst_fenicsx.kernels.axisymmetric.line_pressure import spread_pressure
from burst_fenicsx.kernels.contact.slide_law import SlideLaw, around, slide
from burst_fenicsx.kernels.lanes import block_kernel, inlined_kernel
from burst_fenicsx.kernels.state import ChargeState, Grid, Nodes, SolidState
from burst_fenicsx.kernels.vectors.exact import quantise

__all__ = ["LineContact", "act_on_line", "add_line_forces"]


class LineContact(NamedTuple):
    """Contact of a meridian as it acts in the substeps of a macro step, see `contact.ContactForces`."""

    law: SlideLaw  # of contact's step; without stiffness (its frequency 0) nothing acts yet
    level: int  # of contact's step, the macro step over 2^level
    front_until: float  # s, until which a front runs or is being reflected
    line: SlideLine
    contacts: LineContacts
    slot: np.ndarray  # (cells,) int32
    mass: np.ndarray  # (nodes,) kg
    force: np.ndarray  # (nodes, 3) N, those of contact
    faster: np.ndarray  # int32, nodes that take several steps in one of contact
    last_position: np.ndarray  # (faster, 3) m, where they were at the last one
    own_velocity: np.ndarray  # (faster, 3) m/s, room for theirs
    sums: np.ndarray  # (2,) J so far: work of the forces, heat of friction
    deepest: np.ndarray  # (2,) m so far: penetration while a front runs, and after it


@block_kernel
def act_on_line(
    time: float, contact: LineContact, nodes: Nodes, grid: Grid, solid: SolidState, charge: ChargeState
) -> None:
    """Add the forces of contact at `time` (s), at the end of one of its steps, to those of the nodes (N)."""
    law, force, velocity = contact.law, contact.force, nodes.velocity
    if not law.max_squared_frequency > 0.0:
        return
    if law.step > 0.0:
        for k in range(contact.faster.size):  # mean velocities over the step, in place of their own
            node = contact.faster[k]
            for i in range(3):
                contact.own_velocity[k, i] = velocity[node, i]
                velocity[node, i] = (nodes.position[node, i] - contact.last_position[k, i]) / law.step
                contact.last_position[k, i] = nodes.position[node, i]
    contact.sums[0] += _work(0.5 * law.step, contact, velocity, grid.rounding)
    for node in contact.line.nodes:
        force[node, 0] = force[node, 1] = force[node, 2] = 0.0
    add_line_forces(
        law, contact.line, contact.contacts, charge, solid.eroded, contact.slot, nodes.position, velocity,
        contact.mass, force,
    )  # fmt: skip
    contact.sums[0] += _work(0.5 * law.step, contact, velocity, grid.rounding)
    if law.step > 0.0:
        for k in range(contact.faster.size):
            for i in range(3):
                velocity[contact.faster[k], i] = contact.own_velocity[k, i]
    deepest, after = contact.deepest, 0 if time < contact.front_until else 1
    for c in range(contact.contacts.slave.size):
        contact.sums[1] += quantise(contact.contacts.tally[c, 1], grid.rounding)
        deepest[after] = max(deepest[after], contact.contacts.tally[c, 2])
    fraction = 1.0 / (1 << contact.level)
    for node in contact.line.nodes:
        for i in range(3):
            nodes.force[node, i] += fraction * force[node, i]


@inlined_kernel
def _work(half_step: float, contact: LineContact, velocity: np.ndarray, rounding: float) -> float:
    """Work (J) of the forces as they are now in half a step (s) at the velocities (nodes, 3) in m/s, exact."""
    force, total = contact.force, 0.0
    for node in contact.line.nodes:
        power = 0.0
        for i in range(3):
            power += force[node, i] * velocity[node, i]
        total += quantise(half_step * power, rounding)
    return total


@block_kernel
def add_line_forces(
    law: SlideLaw,
    line: SlideLine,
    contacts: LineContacts,
    charge: ChargeState,
    eroded: np.ndarray,
    slot: np.ndarray,
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
    force: np.ndarray,
) -> None:
    """Find every contact's point and force, advance its state, and add the forces (N) to those of the nodes.

    `eroded` (slots,) is that of `SolidState`, `slot` (cells,) where each cell stands in it; `position`, `velocity` (the
    mean one over the step), `mass` and `force` are those of the nodes.
    """
    boundary_vectors(position, line)
    for c in range(contacts.slave.size):
        find_point(c, law.step, line, contacts, position, velocity)
    spread_pressure(line, contacts, position)
    for c in range(contacts.slave.size):
        cells = contacts.cell[contacts.first_cell[c] : contacts.first_cell[c + 1]]
        burnt, gas, whole = around(cells, charge, eroded, slot, 0.0, 0.0)  # one rank sums in one order
        if contacts.off[c] == 0 and whole == 0.0:
            contacts.off[c] = 1
        _press(c, law, line, contacts, min(burnt / cells.size, 1.0), gas / cells.size, position, velocity, mass)
    for node in line.nodes:
        contacts.load[node] = 0.0
    for c in range(contacts.slave.size):
        _share_force(c, line, contacts, force)


@inlined_kernel
def _share_force(c: int, line: SlideLine, contacts: LineContacts, force: np.ndarray) -> None:
    """Give a contact's force to its node and the opposite to the line: to each what the others lose."""
    node, edge = contacts.slave[c], contacts.face[c]
    for k in range(2):
        other = line.edges[edge, k]
        contacts.load[other] += contacts.weight[c, k]
        if contacts.stiffness[c] > 0.0:
            for i in range(2):
                push = contacts.weight[c, k] * contacts.force[c, i]
                force[other, 2 * i] -= push
                force[node, 2 * i] += push
    if contacts.stiffness[c] > 0.0:
        for k in range(contacts.spread_count[c]):
            other = contacts.spread_over[c, k]
            for i in range(2):
                push = contacts.spread[c, k] * contacts.pressing[c, i]
                force[other, 2 * i] -= push
                force[node, 2 * i] += push


@inlined_kernel
def _press(
    c: int,
    law: SlideLaw,
    line: SlideLine,
    contacts: LineContacts,
    burnt: float,
    pressure: float,
    position: np.ndarray,
    velocity: np.ndarray,
    mass: np.ndarray,
) -> None:
    """Force of a contact by its gap, its slip and the gas around its node; its energies."""
    node, edge, gap = contacts.slave[c], contacts.face[c], contacts.gap[c]
    nr, nz = contacts.normal[c, 0], contacts.normal[c, 1]
    inverse_mass = contacts.of_node[c] / mass[node]
    for k in range(2):
        other, weight = line.edges[edge, k], contacts.weight[c, k]
        inverse_mass += weight * max(contacts.load[other], weight) / mass[other]
    vr, vz = relative_velocity(c, line, contacts, velocity)
    old_slip = contacts.slip[c]
    slip = old_slip + law.step * (vz * nr - vr * nz)
    whole, gas, stiffness, kept, stored, heat, depth = slide(
        law,
        contacts.bonded[c] != 0,
        contacts.off[c] != 0,
        burnt,
        pressure,
        contacts.strength[c],
        abs(_ring_area(c, contacts, position, nr, nz)),
        gap,
        law.max_squared_frequency / inverse_mass,
        abs(slip),
        contacts.stiffness[c],
        abs(old_slip),
    )
    slip = np.copysign(kept, slip)
    contacts.tally[c, 0], contacts.tally[c, 1], contacts.tally[c, 2] = stored, heat, depth
    contacts.bonded[c] = 1 if whole else 0
    contacts.stiffness[c], contacts.slip[c] = stiffness, slip
    contacts.pressing[c, 0], contacts.pressing[c, 1] = gas * nr, gas * nz
    contacts.force[c, 0] = -stiffness * (gap * nr - slip * nz)
    contacts.force[c, 1] = -stiffness * (gap * nz + slip * nr)


@inlined_kernel
def _ring_area(c: int, contacts: LineContacts, position: np.ndarray, nr: float, nz: float) -> float:
    """The contact's share of the charge's surface, projected on the normal (m2): what a pressure there acts on.

    An edge from a to b gives a the share 2 pi (2 r_a + r_b) / 6 of its length times its normal.
    """
    total, node = 0.0, contacts.slave[c]
    for k in range(2):
        a, b = contacts.side[c, k, 0], contacts.side[c, k, 1]
        if a >= 0:
            other = b if a == node else a
            weight = edge_weight(position[node, 0], position[other, 0])
            dr, dz = position[b, 0] - position[a, 0], position[b, 2] - position[a, 2]
            total += weight * (dz * nr - dr * nz)
    return total
