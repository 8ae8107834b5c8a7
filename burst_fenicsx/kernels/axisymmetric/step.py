"""One macro step of the axisymmetric burst in one call.

It has up to hundreds of parts (`burst_fenicsx.mechanics.subcycling`), and a call from Python costs as much as a hundred
cells. One thread does all of it: the result does not depend on the number of threads.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from burst_fenicsx.kernels.axisymmetric import quadrilateral, ring_hourglass
from burst_fenicsx.kernels.axisymmetric.line_points import LineContacts, SlideLine
from burst_fenicsx.kernels.axisymmetric.quadrilateral import AxisymmetricState
from burst_fenicsx.kernels.axisymmetric.slide_line import add_line_forces
from burst_fenicsx.kernels.cells import charge as charge_cells
from burst_fenicsx.kernels.cells import solid as solid_cells
from burst_fenicsx.kernels.cells.block import make_block
from burst_fenicsx.kernels.contact.slide_law import SlideLaw
from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.state import ChargeState, Grid, Motion, Nodes, Schedule, SolidState
from burst_fenicsx.problem import Part

__all__ = ["RingSums", "add_ring_forces", "advance_rings"]

_PARTS = len(Part)  # rows of material parameters that each round has

_advance_solid_rings = make_block(quadrilateral, ring_hourglass, solid_cells)
_advance_charge_rings = make_block(quadrilateral, ring_hourglass, charge_cells)


class RingSums(NamedTuple):
    """Sums over the parts of a step, added to, and limits of the last one."""

    energy: np.ndarray  # (5,) J: plastic, viscous, hourglass, work of the charge, its own viscous heat
    released: np.ndarray  # (rounds, 2) J: the last two of each round's charge
    contact: np.ndarray  # (3,) J: friction heat, work on the nodes, and the largest penetration (m)
    limits: np.ndarray  # (3,) smallest stable macro step (s), smallest volume (m3) and its cell
    own: np.ndarray  # (nodes, 3) N, forces of contact alone


@kernel
def add_ring_forces(
    step: float,
    stable_for: float,
    time: float,
    min_level: int,
    moving: int,
    scratch: np.ndarray,
    nodes: Nodes,
    motion: Motion,
    grid: Grid,
    schedule: Schedule,
    solid: SolidState,
    charge: ChargeState,
    rings: AxisymmetricState,
    contact_level: int,
    at_unit_step: SlideLaw,
    line: SlideLine,
    contacts: LineContacts,
    sums: RingSums,
) -> None:
    """Advance the cells of level `min_level` and higher to `time` (s); the forces (N) of their nodes are set.

    `step` is the macro step (s) that led here, `stable_for` the one for which the springs of contact must be stable.
    Contact's own step is the macro step over 2^`contact_level`; `at_unit_step` is its law for a step of 1 s.
    """
    for k in range(moving):
        node = motion.order[k]
        for i in range(3):
            nodes.force[node, i] = 0.0
    sums.limits[0] = sums.limits[1] = np.inf
    sums.limits[2] = -1.0
    for chunk in schedule.chunk:
        first = schedule.first_solid[chunk]
        for block in range(first, first + schedule.active[chunk, min_level, 0]):
            share = 1.0 / (1 << grid.level[block])
            _advance_solid_rings(
                block,
                share * step,
                time,
                share,
                nodes,
                grid,
                solid,
                rings,
                solid.eroded,
                scratch,
                sums.energy,
                sums.limits,
            )
        first = schedule.first_charge[chunk]
        for block in range(first, first + schedule.active[chunk, min_level, 1]):
            share = 1.0 / (1 << grid.level[block])
            work_before, heat_before = sums.energy[3], sums.energy[4]
            _advance_charge_rings(
                block,
                share * step,
                time,
                share,
                nodes,
                grid,
                charge,
                rings,
                solid.eroded,
                scratch,
                sums.energy,
                sums.limits,
            )
            owner = grid.material[block] // _PARTS
            sums.released[owner, 0] += sums.energy[3] - work_before
            sums.released[owner, 1] += sums.energy[4] - heat_before
    if contact_level >= min_level and stable_for > 0.0:
        share = 1.0 / (1 << contact_level)
        frequency = at_unit_step.max_squared_frequency / (share * stable_for) ** 2
        strength, cohesion, friction = at_unit_step.tensile_strength, at_unit_step.cohesion, at_unit_step.friction
        law = SlideLaw(frequency, share * step, strength, cohesion, friction)
        sums.contact[1] += add_line_forces(
            law,
            share,
            line,
            contacts,
            charge,
            solid.eroded,
            rings.slot,
            nodes.position,
            rings.mass,
            sums.own,
            nodes.force,
        )
        for c in range(contacts.slave.size):
            sums.contact[0] += contacts.tally[c, 1]
            sums.contact[2] = max(sums.contact[2], contacts.tally[c, 2])
    for node in rings.axis:
        nodes.force[node, 0] = 0.0


@kernel
def advance_rings(
    begin: float,
    step: float,
    last_step: float,
    stable_for: float,
    highest: int,
    moving: np.ndarray,
    scratch: np.ndarray,
    nodes: Nodes,
    motion: Motion,
    grid: Grid,
    schedule: Schedule,
    solid: SolidState,
    charge: ChargeState,
    rings: AxisymmetricState,
    contact_level: int,
    at_unit_step: SlideLaw,
    line: SlideLine,
    contacts: LineContacts,
    sums: RingSums,
) -> bool:
    """All parts of a macro step (s) but for its last forces, before which the caller lets the products vent.

    `begin` (s) is its start, `last_step` (s) the one before; `moving` (levels,) how many nodes take part at each level.
    Returns whether no cell is lost.
    """
    count = 1 << highest
    velocity_step, min_level = 0.5 * (last_step + step), 0
    for part in range(count):
        _move(moving[min_level], velocity_step, step, part, highest, nodes, motion)
        if part + 1 == count:
            return True
        # Cells of the shortest steps end one with every part, those of twice the step with every second one, ...
        min_level, rest = highest, part + 1
        while rest % 2 == 0:
            rest //= 2
            min_level -= 1
        add_ring_forces(
            step,
            stable_for,
            begin + step * ((part + 1) / count),
            min_level,
            moving[min_level],
            scratch,
            nodes,
            motion,
            grid,
            schedule,
            solid,
            charge,
            rings,
            contact_level,
            at_unit_step,
            line,
            contacts,
            sums,
        )
        if not (sums.limits[0] > 0.0 and sums.limits[1] > 0.0):
            return False
        velocity_step = step
    return True


@kernel
def _move(
    moving: int, velocity_step: float, step: float, part: int, highest: int, nodes: Nodes, motion: Motion
) -> None:
    """As `kernels.step.assembly.move_nodes`, in the half plane and on one thread."""
    for k in range(moving):
        node, level = motion.order[k], motion.level[k]
        own, push = step / (1 << level), velocity_step * motion.inverse_mass[k]
        r = nodes.velocity[node, 0] + push * nodes.force[node, 0]
        z = nodes.velocity[node, 2] + push * nodes.force[node, 2]
        nodes.velocity[node, 0], nodes.velocity[node, 2] = r, z
        nodes.position[node, 0] += own * r
        nodes.position[node, 2] += own * z
        if motion.lower[k]:
            # After the first of the two steps the mean is that step's velocity.
            before = 0.5 * ((part >> (highest - level)) & 1)
            nodes.mean[node, 0] = (1.0 - before) * r + before * nodes.mean[node, 0]
            nodes.mean[node, 2] = (1.0 - before) * z + before * nodes.mean[node, 2]
