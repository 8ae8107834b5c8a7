"""The element forces (Eq. 1): what happens to the blocks of a chunk in a step, one routine for metal, one for charges.

`element` is one of those of `step.assembly`, known while compiling by its length: what belongs to another element is
left out.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.axisymmetric import quadrilateral
from burst_fenicsx.kernels.cells import charge as gas
from burst_fenicsx.kernels.cells import eight_points, one_point
from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells import solid as metal
from burst_fenicsx.kernels.cells.erosion import drop_forces, freeze_cells
from burst_fenicsx.kernels.cells.hexahedron import nodes_to_modes
from burst_fenicsx.kernels.lanes import (
    LANES,
    addressed_kernel,
    block_kernel,
    inlined_kernel,
    lane_function,
    widest_vectors,
)
from burst_fenicsx.kernels.vectors.exact import quantise, row_sum
from burst_fenicsx.kernels.vectors.gather import add_nodal_forces, gather_nodes, load_slots, store_slots
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.kernels.state import Cells, Grid, Nodes

_PARTS = len(Part)  # rows of material parameters that each round has
_LINEAR, _QUADRATIC, _DAMPING, _STIFFNESS = (
    at.SOLID_PARAMETERS.index(name)
    for name in ("linear_viscosity", "quadratic_viscosity", "hourglass_viscous", "hourglass_stiffness")
)
_GAS_LINEAR, _GAS_QUADRATIC, _GAS_DAMPING = (
    at.CHARGE_PARAMETERS.index(name) for name in ("linear_viscosity", "quadratic_viscosity", "hourglass_viscous")
)


@addressed_kernel
def advance_solids(
    element: tuple[int, ...], first: int, last: int, step: float, cells: Cells, scratch: np.ndarray
) -> None:
    """Advance blocks of solid cells and add their nodal forces, times the fraction that their step is of `step` (s).

    The sums and limits of `_add_work` stand in the row `ENERGY` of the scratch.
    """
    widest_vectors()
    nodes, grid, state = cells.nodes, cells.grid, cells.solid
    energy = scratch[at.ENERGY * LANES :]
    for block in range(first, last):
        fraction = 1.0 / (1 << grid.level[block])
        own_step = fraction * step
        next_dt = max(own_step, fraction * grid.longest)
        parameters = state.parameters[grid.material[block]]
        _load(block, nodes, grid, scratch)
        if len(element) == 2:
            quadrilateral.load_shares(block, cells.inverse_share, scratch)
            quadrilateral.velocity_gradient(own_step, scratch)
        else:
            nodes_to_modes(scratch)
            one_point.velocity_gradient(own_step, scratch)
        if len(element) == 3:
            eight_points.begin_points(scratch)
        metal.load(block, state, scratch)
        any_eroded = metal.erode(block, parameters, grid, state, scratch) > 0
        for point in range(state.stress.shape[1]):
            if len(element) == 3:
                eight_points.velocity_gradient(point, own_step, scratch)
            if any_eroded:
                freeze_cells(block, grid, state.eroded, scratch)
            metal.load_point(block, point, grid, state, scratch)
            metal.trial_stress(element, own_step, parameters, scratch)
            metal.return_stress(parameters, scratch)
            if len(element) == 3:
                eight_points.add_stress(point, scratch)
            metal.store_point(block, point, grid, state, scratch)
        if len(element) == 3:
            eight_points.end_points(scratch)
        modulus = metal.sound_speeds(parameters, scratch)
        viscosity(parameters[_LINEAR], parameters[_QUADRATIC], scratch)
        damping, stiffness = parameters[_DAMPING], parameters[_STIFFNESS]
        if len(element) == 1:
            one_point.hourglass_coefficients(damping, stiffness, modulus, own_step, next_dt, scratch)
        elif len(element) == 2:
            quadrilateral.hourglass_coefficients(damping, stiffness, modulus, own_step, next_dt, scratch)
        else:
            eight_points.hourglass_coefficients(damping, next_dt, scratch)
        if any_eroded:
            metal.clear_state(block, parameters, grid, state, scratch)
        if len(element) == 1:
            one_point.springs_and_dashpots(scratch)
            one_point.nodal_forces(fraction, nodes.rounding, scratch)
        elif len(element) == 2:
            quadrilateral.springs_and_dashpots(scratch)
            quadrilateral.nodal_forces(fraction, scratch)
        else:
            one_point.dashpots(scratch)
            eight_points.nodal_forces(fraction, nodes.rounding, scratch)
        if any_eroded:
            drop_forces(block, state.eroded, scratch)
        add_nodal_forces(block, grid, scratch[at.FORCE * LANES :], nodes.force)
        energy[0] += metal.store(block, grid, state, scratch)
        _add_work(block, own_step, fraction, grid, scratch, energy)


@addressed_kernel
def advance_charges(
    element: tuple[int, ...],
    first: int,
    last: int,
    step: float,
    time: float,
    cells: Cells,
    scratch: np.ndarray,
    released: np.ndarray,
) -> None:
    """The same of a charge's blocks to the `time` (s); `released` (rounds, 2) J as in `Totals`, added to."""
    widest_vectors()
    nodes, grid, state, eroded = cells.nodes, cells.grid, cells.charge, cells.solid.eroded
    energy = scratch[at.ENERGY * LANES :]
    for block in range(first, last):
        fraction = 1.0 / (1 << grid.level[block])
        own_step = fraction * step
        next_dt = max(own_step, fraction * grid.longest)
        parameters = state.parameters[grid.material[block]]
        _load(block, nodes, grid, scratch)
        if len(element) == 2:
            quadrilateral.load_shares(block, cells.inverse_share, scratch)
            quadrilateral.velocity_gradient(own_step, scratch)
        else:
            nodes_to_modes(scratch)
            one_point.velocity_gradient(own_step, scratch)
        min_burn = gas.load(block, time, parameters, grid, state, scratch)
        any_eroded = gas.erode(block, parameters, eroded, scratch) > 0
        if any_eroded:
            freeze_cells(block, grid, eroded, scratch)
        energy[0] += gas.pressure(block, own_step, min_burn, parameters, grid, state, scratch)
        gas.sound_speeds(parameters, scratch)
        viscosity(parameters[_GAS_LINEAR], parameters[_GAS_QUADRATIC], scratch)
        if len(element) == 2:
            quadrilateral.hourglass_coefficients(parameters[_GAS_DAMPING], 0.0, 0.0, own_step, next_dt, scratch)
        else:
            one_point.hourglass_coefficients(parameters[_GAS_DAMPING], 0.0, 0.0, own_step, next_dt, scratch)
        if any_eroded:
            gas.clear_state(block, eroded, scratch)
        if len(element) == 2:
            quadrilateral.dashpots(scratch)
            quadrilateral.nodal_forces(fraction, scratch)
        else:
            one_point.dashpots(scratch)
            one_point.nodal_forces(fraction, nodes.rounding, scratch)
        if any_eroded:
            drop_forces(block, eroded, scratch)
        add_nodal_forces(block, grid, scratch[at.FORCE * LANES :], nodes.force)
        work, heat = gas.store(block, parameters, grid, state, scratch)
        owner = grid.material[block] // _PARTS
        released[owner, 0] += work
        released[owner, 1] += heat
        energy[3] += work
        energy[4] += heat
        _add_work(block, own_step, fraction, grid, scratch, energy)


@inlined_kernel
def _load(block: int, nodes: Nodes, grid: Grid, scratch: np.ndarray) -> None:
    gather_nodes(block, nodes, grid, scratch[at.POSITION * LANES :], scratch[at.VELOCITY * LANES :])
    load_slots(block, grid.mass, scratch[at.MASS * LANES :])
    load_slots(block, grid.volume, scratch[at.OLD_VOLUME * LANES :])
    load_slots(block, grid.viscous, scratch[at.OLD_VISCOUS * LANES :])


@lane_function
def viscosity_and_step(
    dilatation: float,
    length: float,
    density: float,
    sound: float,
    fastest: float,
    linear: float,
    quadratic: float,
) -> tuple[float, float]:
    """Artificial viscous pressure q (Pa) in compression and the stable step (s) with it.

    q = rho L |D| (q1 c + q2 L |D|), D the rate of volume (von Neumann and Richtmyer 1950, Landshoff 1955).
    The damped mode of frequency omega = 2 c/L with the ratio zeta = q1 + q2 L |D| / c of the critical
    damping allows dt <= (2/omega) (sqrt(1 + zeta^2) - zeta) (Belytschko et al. 2000, section 6.2).
    `fastest` is the sound speed that the step must allow for.
    """
    closing = length * max(-dilatation, 0.0)
    speed = quadratic * closing
    damped = linear * fastest + speed if dilatation < 0.0 else 0.0
    viscous = density * closing * (linear * sound + speed)
    return viscous, length / (np.sqrt(fastest * fastest + damped * damped) + damped)


@block_kernel
def viscosity(linear: float, quadratic: float, scratch: np.ndarray) -> None:
    """Artificial viscous pressure of a block's cells and their stable steps with it."""
    widest_vectors()
    for lane in range(LANES):
        viscous, stable = viscosity_and_step(
            scratch[at.DILATATION * LANES + lane],
            scratch[at.LENGTH * LANES + lane],
            scratch[at.DENSITY * LANES + lane],
            scratch[at.SOUND * LANES + lane],
            scratch[at.FASTEST * LANES + lane],
            linear,
            quadratic,
        )
        scratch[at.VISCOUS * LANES + lane], scratch[at.STABLE * LANES + lane] = viscous, stable


@inlined_kernel
def _add_work(block: int, step: float, fraction: float, grid: Grid, scratch: np.ndarray, energy: np.ndarray) -> None:
    """Add the work of viscosity and hourglass control to `energy`, keep the smallest step and volume in its end."""
    widest_vectors()
    filled, rounding = grid.filled[block], grid.rounding
    below = 0
    for lane in range(LANES):
        volume, viscous = scratch[at.VOLUME * LANES + lane], scratch[at.VISCOUS * LANES + lane]
        # Mean of both ends of the step, as the forces work: at a front q changes within it.
        viscous = 0.5 * (scratch[at.OLD_VISCOUS * LANES + lane] + viscous)
        heat = -quantise(viscous * (volume - scratch[at.OLD_VOLUME * LANES + lane]), rounding)
        work = quantise(scratch[at.HOURGLASS_POWER * LANES + lane] * step, rounding)
        scratch[at.HEAT * LANES + lane] = heat if lane < filled else 0.0
        scratch[at.HOURGLASS_POWER * LANES + lane] = work if lane < filled else 0.0
        low = scratch[at.STABLE * LANES + lane] < fraction * energy[5]
        below += 0 if (scratch[at.MIN_VOLUME * LANES + lane] >= energy[6]) & (not low) else 1
    if below > 0:
        for lane in range(filled):
            stable, volume = scratch[at.STABLE * LANES + lane], scratch[at.MIN_VOLUME * LANES + lane]
            if stable < fraction * energy[5]:
                energy[5] = stable / fraction
            if not volume >= energy[6]:
                # NaN must not be overwritten by the next cell.
                energy[6] = volume if volume == volume else -np.inf
                energy[7] = grid.cells[block, lane]
    store_slots(block, scratch[at.VISCOUS * LANES :], grid.viscous)
    store_slots(block, scratch[at.STABLE * LANES :], grid.stable)
    store_slots(block, scratch[at.VOLUME * LANES :], grid.volume)
    energy[1] += row_sum(scratch, at.HEAT)
    energy[2] += row_sum(scratch, at.HOURGLASS_POWER)
