"""The step of a block of charge cells: burnt fraction, strength, hourglass control, nodal forces, crushed products."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells.charge_pressure import (
    BURN,
    BY_COMPRESSION,
    CONTENT,
    HELD,
    LEAKAGE,
    OLD_PRESSURE,
    OLD_VOLUME,
    PRESSURE,
    STIFFNESS,
    STORED,
    STRESS,
    burn_by_compression,
    press_by_jwl,
    press_by_landau,
)
from burst_fenicsx.kernels.cells.common import (
    COEFFICIENT_LIMIT,
    DAMPING,
    FORCE,
    FREQUENCY,
    HOURGLASS,
    MASS,
    MOST_DAMPED,
    POSITION,
    POWER,
    RATE,
    STABLE,
    VELOCITY,
    VISCOUS,
    VOLUME,
    bound_hourglass,
    force_modes,
    gather_velocities,
    lower_limits,
    may_overdo,
    move_cells,
    trace_of_rate,
    viscosity_and_step,
)
from burst_fenicsx.kernels.cells.hexahedron import store_nodal_forces
from burst_fenicsx.kernels.cells.solid import elastic_trial, spin
from burst_fenicsx.kernels.cells.torn_metal import BEFORE, WHOLE, drop_forces, keep_still
from burst_fenicsx.kernels.lanes import LANES, block_kernel, inlined_kernel, widest_vectors
from burst_fenicsx.kernels.state import ChargeState, Grid, Nodes
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.nodal_values import add_nodal_forces, gather
from burst_fenicsx.kernels.vectors.tensors import (
    dot,
    load_matrix,
    load_symmetric,
    load_vector,
    scaled,
    store_symmetric,
    symmetric_square,
)

__all__ = ["CRUSHED", "add_work", "charge_block", "hold_by_strength", "load_state"]

CRUSHED = 0.3
"""Volume of products over that of the charge below which nothing real presses them: with gamma 3 they have 16 times the
pressure of Chapman and Jouguet there."""


@inlined_kernel
def charge_block(
    block: int,
    step: float,
    time: float,
    share: float,
    nodes: Nodes,
    grid: Grid,
    state: ChargeState,
    released: np.ndarray,
    scratch: np.ndarray,
    energy: np.ndarray,
    limits: np.ndarray,
) -> None:
    """Advance one block of charge cells by `step` to `time` (s) and add its nodal forces times `share`.

    `released` is that of `SolidState`; `share`, `energy` and `limits` as for `solid_block`; entry 3 of `energy` is the
    work of the charge's pressure, entry 4 the part of it that the charge's own artificial viscosity turns to heat.
    """
    cells = grid.cells[block]
    count = grid.filled[block]
    material = state.parameters[grid.material[block]]
    gather(cells, grid.dofmap, nodes.position, scratch[POSITION * LANES :])
    gather_velocities(block, nodes, grid, scratch[VELOCITY * LANES :])
    move_cells(step, scratch)
    min_burn = load_state(block, time, material[8], grid, state, scratch)
    crushed = _hold_crushed(block, material[0], grid, released, scratch) > 0
    if min_burn < 1.0:
        burn_by_compression(material, scratch)
    if material[9] == 0.0:
        press_by_landau(material, scratch)
    else:
        press_by_jwl(material, scratch)
    # The step in which a cell burns out still takes its deviator to zero.
    if min_burn < 1.0:
        hold_by_strength(block, step, material, grid, state, scratch, energy)
    next_dt = max(step, share * grid.longest)
    bound_hourglass(next_dt, _stiffen(next_dt, material, scratch) > 0, scratch)
    if crushed:
        _empty(block, released, scratch)
    _resist(share, nodes.rounding, scratch)
    if crushed:
        drop_forces(block, released, scratch)
    add_nodal_forces(count, cells, grid.dofmap, scratch[FORCE * LANES :], nodes.force)
    add_work(block, step, share, material, grid, state, scratch, energy, limits)


@block_kernel
def load_state(
    block: int, time: float, by_compression: float, grid: Grid, state: ChargeState, scratch: np.ndarray
) -> float:
    """Gather the cell state into lanes and burn cells as far as time does.

    Returns the smallest fraction burnt before. Where all is burnt, the row of burning by compression is not set.
    """
    slot = block * LANES
    min_burn = 1.0
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        burn = state.burn_fraction[cell]
        min_burn = min(min_burn, burn)
        scratch[BURN * LANES + lane] = burn
        scratch[OLD_PRESSURE * LANES + lane] = state.pressure[cell]
        scratch[CONTENT * LANES + lane] = state.energy[cell]
        scratch[LEAKAGE * LANES + lane] = state.leakage[state.axial_part[cell]]
        scratch[MASS * LANES + lane] = grid.mass[slot + lane]
        scratch[OLD_VOLUME * LANES + lane] = grid.volume[slot + lane]
    for k in range(6 * LANES):
        scratch[STRESS * LANES + k] = 0.0
    if min_burn < 1.0:
        for lane in range(LANES):
            cell = np.uint64(grid.cells[block, lane])
            by_time = (time - state.ignition_time[cell]) * state.burn_rate[cell]
            scratch[BURN * LANES + lane] = max(scratch[BURN * LANES + lane], min(by_time, 1.0))
            scratch[BY_COMPRESSION * LANES + lane] = by_compression if time >= state.compression_from[cell] else 0.0
    return min_burn


@block_kernel
def _hold_crushed(block: int, density: float, grid: Grid, released: np.ndarray, scratch: np.ndarray) -> int:
    """Release cells of products that have hardly any volume left, pinched off between nodes; hold those released.

    As torn metal, they keep the volume that they had and take no part in the motion any more. `density` is the
    charge's (kg/m3). Returns how many lanes are released.
    """
    slot, count = block * LANES, 0
    for lane in range(LANES):
        relative = scratch[VOLUME * LANES + lane] * density / scratch[MASS * LANES + lane]
        if not relative > CRUSHED and scratch[BURN * LANES + lane] >= 1.0 and released[slot + lane] == WHOLE:
            released[slot + lane] = BEFORE
        if released[slot + lane] == WHOLE:
            continue
        count += 1
        keep_still(slot + lane, lane, grid, scratch)
    return count


@block_kernel
def _empty(block: int, released: np.ndarray, scratch: np.ndarray) -> None:
    """Take pressure, strength, viscosity, hourglass control and their share of the stable step from released cells.

    Their pressure is what contact with the casing reads.
    """
    for lane in range(LANES):
        if released[block * LANES + lane] != WHOLE:
            scratch[PRESSURE * LANES + lane] = 0.0
            store_symmetric((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), scratch, STRESS, lane)
            scratch[VISCOUS * LANES + lane] = scratch[DAMPING * LANES + lane] = 0.0
            scratch[STABLE * LANES + lane] = np.inf


@block_kernel
def hold_by_strength(
    block: int,
    step: float,
    material: np.ndarray,
    grid: Grid,
    state: ChargeState,
    scratch: np.ndarray,
    energy: np.ndarray,
) -> None:
    """Weak strength of the unreacted charge: elastic, ideally plastic (von Mises in shear), fading as it burns.

    Its whole work is counted as plastic, since what is stored elastically is lost when the cell burns.
    """
    widest_vectors()
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            scratch[(STORED + k) * LANES + lane] = state.stress[cell, 0, k]
    for lane in range(LANES):
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = load_matrix(scratch, RATE, lane)
        mean = (xx + yy + zz) * (1.0 / 3.0)
        rate = ((xx - mean, xy, xz), (yx, yy - mean, yz), (zx, zy, zz - mean))
        old = load_symmetric(scratch, STORED, lane)
        trial = elastic_trial(old, spin(rate, step), rate, step, 0.0, material[2])
        norm = np.sqrt(symmetric_square(trial))
        limit = (1.0 - scratch[BURN * LANES + lane]) * material[3]
        factor = limit / norm if norm > limit else 1.0
        txx, tyy, tzz = scaled(factor, (trial[0], trial[1], trial[2]))
        txy, tyz, tzx = scaled(factor, (trial[3], trial[4], trial[5]))
        store_symmetric((txx, tyy, tzz, txy, tyz, tzx), scratch, STRESS, lane)
        scratch[HELD * LANES + lane] = 0.5 * (
            dot((txx + old[0], tyy + old[1], tzz + old[2]), (rate[0][0], rate[1][1], rate[2][2]))
            + dot((txy + old[3], tyz + old[4], tzx + old[5]), (xy + yx, yz + zy, zx + xz))
        )
    work = 0.0
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            state.stress[cell, 0, k] = scratch[(STRESS + k) * LANES + lane]
        work += quantise(scratch[HELD * LANES + lane] * step * scratch[VOLUME * LANES + lane], grid.rounding)
    energy[0] += work


@block_kernel
def _stiffen(next_dt: float, material: np.ndarray, scratch: np.ndarray) -> int:
    """Artificial viscosity, stable steps and hourglass coefficients; count the cells that may not bear the latter.

    Their limits depend on the next step, `next_dt` (s).
    """
    widest_vectors()
    # While a cell may still ignite, the step allows for the products' sound speed at the front, 3/4 D.
    front_speed = 0.75 * material[7]
    per_mass = 1.0 / (8.0 * next_dt) if next_dt > 0.0 else np.inf
    count = 0
    for lane in range(LANES):
        frequency, mass = scratch[FREQUENCY * LANES + lane], scratch[MASS * LANES + lane]
        density = mass / scratch[VOLUME * LANES + lane]
        sound = np.sqrt(scratch[STIFFNESS * LANES + lane] / density)
        fastest = max(sound, front_speed) if scratch[BURN * LANES + lane] < 1.0 else sound
        viscous, stable = viscosity_and_step(
            trace_of_rate(scratch, lane), 1.0 / frequency, density, sound, fastest, material[4], material[5]
        )
        damping = 0.25 * material[6] * mass * sound * frequency
        scratch[VISCOUS * LANES + lane] = viscous
        scratch[STABLE * LANES + lane] = stable
        scratch[DAMPING * LANES + lane] = damping
        count += 1 if may_overdo(damping * (1.0 / MOST_DAMPED), mass * per_mass, scratch, lane) else 0
    return count


@block_kernel
def _resist(share: float, rounding: float, scratch: np.ndarray) -> None:
    """Nodal forces of pressure, strength, artificial viscosity and hourglass control."""
    widest_vectors()
    for lane in range(LANES):
        b3, b5 = scratch[COEFFICIENT_LIMIT * LANES + lane], scratch[(COEFFICIENT_LIMIT + 1) * LANES + lane]
        b6, b7 = scratch[(COEFFICIENT_LIMIT + 2) * LANES + lane], scratch[(COEFFICIENT_LIMIT + 3) * LANES + lane]
        damping = min(scratch[DAMPING * LANES + lane], MOST_DAMPED * min(b3, b5, b6, b7))
        q3, q5 = load_vector(scratch, HOURGLASS, lane), load_vector(scratch, HOURGLASS + 3, lane)
        q6, q7 = load_vector(scratch, HOURGLASS + 6, lane), load_vector(scratch, HOURGLASS + 9, lane)
        resistance = (scaled(damping, q3), scaled(damping, q5), scaled(damping, q6), scaled(damping, q7))
        scratch[POWER * LANES + lane] = damping * (dot(q3, q3) + dot(q5, q5) + dot(q6, q6) + dot(q7, q7))
        xx, yy, zz, xy, yz, zx = load_symmetric(scratch, STRESS, lane)
        pressure = scratch[LEAKAGE * LANES + lane] * scratch[PRESSURE * LANES + lane] + scratch[VISCOUS * LANES + lane]
        stress = (xx - pressure, yy - pressure, zz - pressure, xy, yz, zx)
        store_nodal_forces(force_modes(stress, resistance, scratch, lane), share, rounding, scratch, FORCE, lane)


@block_kernel
def add_work(
    block: int,
    step: float,
    share: float,
    material: np.ndarray,
    grid: Grid,
    state: ChargeState,
    scratch: np.ndarray,
    energy: np.ndarray,
    limits: np.ndarray,
) -> None:
    """Add up the work of the step, find the limits and write the cell state back."""
    slot = block * LANES
    heat = work = hourglass = 0.0
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        volume, viscous = scratch[VOLUME * LANES + lane], scratch[VISCOUS * LANES + lane]
        pressure, stable = scratch[PRESSURE * LANES + lane], scratch[STABLE * LANES + lane]
        change = volume - scratch[OLD_VOLUME * LANES + lane]
        # Mean of both ends of the step, as the forces work: at the front q rises and falls within a few steps.
        heating = -0.5 * (grid.viscous[slot + lane] + viscous) * change
        heat += quantise(heating, grid.rounding)
        mean_pressure = 0.5 * (scratch[OLD_PRESSURE * LANES + lane] + pressure)
        work += quantise(scratch[LEAKAGE * LANES + lane] * mean_pressure * change, grid.rounding)
        hourglass += quantise(scratch[POWER * LANES + lane] * step, grid.rounding)
        grid.viscous[slot + lane] = viscous
        grid.stable[slot + lane] = stable
        grid.volume[slot + lane] = volume
        lower_limits(grid.cells[block, lane], stable, volume, share, limits)
        state.pressure[cell] = pressure
        state.burn_fraction[cell] = scratch[BURN * LANES + lane]
        # The shock's heat enters the products' energy a step late, but whole.
        state.energy[cell] = scratch[CONTENT * LANES + lane] + heating * material[0] / scratch[MASS * LANES + lane]
    energy[1] += heat
    energy[2] += hourglass
    energy[3] += work
    energy[4] += heat
