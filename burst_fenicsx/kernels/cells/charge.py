"""The charge: burnt fraction, pressure, strength of what has not reacted; element erosion of crushed products."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.charge_pressure import burn_by_compression
from burst_fenicsx.kernels.cells.erosion import BEFORE, WHOLE, clear_lane
from burst_fenicsx.kernels.cells.solid import elastic_trial, spin
from burst_fenicsx.kernels.constants import CRUSHED, FRONT_SOUND
from burst_fenicsx.kernels.lanes import LANES, block_kernel, chosen, inlined_kernel, widest_vectors
from burst_fenicsx.kernels.vectors.exact import quantise, row_sum
from burst_fenicsx.kernels.vectors.tensors import (
    dot,
    load_matrix,
    load_symmetric,
    scaled,
    store_symmetric,
    symmetric_square,
)
from burst_fenicsx.materials import laws

if TYPE_CHECKING:
    from burst_fenicsx.kernels.state import ChargeState, Grid

_MAY_BE_CRUSHED = 1.001 * CRUSHED  # relative volume above which no rounding makes a cell crushed

_press = chosen([model.press for model in laws("products")], at.CHARGE_PARAMETERS.index("model"))


@inlined_kernel
def load(block: int, time: float, parameters: np.ndarray, grid: Grid, state: ChargeState, scratch: np.ndarray) -> float:
    """Gather the cell state into lanes and burn cells as far as time does.

    Returns the smallest fraction burnt before. Where all is burnt, the row of burning by compression is not set.
    """
    by_compression, min_burn = parameters[8], 1.0
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        burn = state.burn_fraction[cell]
        min_burn = min(min_burn, burn)
        scratch[at.BURN * LANES + lane] = burn
        scratch[at.OLD_GAS_PRESSURE * LANES + lane] = state.pressure[cell]
        scratch[at.GAS_ENERGY * LANES + lane] = state.energy[cell]
        scratch[at.LEAKAGE * LANES + lane] = state.leakage[np.uint64(state.axial_slice[cell])]
    for k in range(6 * LANES):
        scratch[at.STRESS * LANES + k] = 0.0
    if min_burn < 1.0:
        for lane in range(LANES):
            cell = np.uint64(grid.cells[block, lane])
            by_time = (time - state.ignition_time[cell]) * state.burn_rate[cell]
            scratch[at.BURN * LANES + lane] = max(scratch[at.BURN * LANES + lane], min(by_time, 1.0))
            scratch[at.BY_COMPRESSION * LANES + lane] = by_compression if time >= state.compression_from[cell] else 0.0
    return min_burn


@inlined_kernel
def pressure(
    block: int,
    step: float,
    min_burn: float,
    parameters: np.ndarray,
    grid: Grid,
    state: ChargeState,
    scratch: np.ndarray,
) -> float:
    """Burn a block's cells by compression, find their pressure and the strength of what is unreacted; its work (J).

    `min_burn` is the smallest fraction burnt before, as `load` gives it.
    """
    if min_burn < 1.0:
        burn_by_compression(parameters, scratch)
    _press(parameters, scratch)
    for lane in range(LANES):
        vented = scratch[at.LEAKAGE * LANES + lane] * scratch[at.GAS_PRESSURE * LANES + lane]
        scratch[at.PRESSURE * LANES + lane] = vented
    # The step in which a cell burns out still takes its deviator to zero.
    return _hold_by_strength(block, step, parameters, grid, state, scratch) if min_burn < 1.0 else 0.0


@inlined_kernel
def _hold_by_strength(
    block: int,
    step: float,
    material: np.ndarray,
    grid: Grid,
    state: ChargeState,
    scratch: np.ndarray,
) -> float:
    """Weak strength of the unreacted charge: elastic, ideally plastic (von Mises in shear), fading as it burns.

    Its whole work is counted as plastic, since what is stored elastically is lost when the cell burns.
    """
    widest_vectors()
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            scratch[(at.OLD_DEVIATOR + k) * LANES + lane] = state.stress[cell, 0, k]
    for lane in range(LANES):
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = load_matrix(scratch, at.RATE, lane)
        mean = (xx + yy + zz) * (1.0 / 3.0)
        rate = ((xx - mean, xy, xz), (yx, yy - mean, yz), (zx, zy, zz - mean))
        old = load_symmetric(scratch, at.OLD_DEVIATOR, lane)
        trial = elastic_trial(old, spin(rate, step), rate, step, 0.0, material[2])
        norm = np.sqrt(symmetric_square(trial))
        limit = (1.0 - scratch[at.BURN * LANES + lane]) * material[3]
        factor = limit / norm if norm > limit else 1.0
        txx, tyy, tzz = scaled(factor, (trial[0], trial[1], trial[2]))
        txy, tyz, tzx = scaled(factor, (trial[3], trial[4], trial[5]))
        store_symmetric((txx, tyy, tzz, txy, tyz, tzx), scratch, at.STRESS, lane)
        scratch[at.DEVIATOR_POWER * LANES + lane] = 0.5 * (
            dot((txx + old[0], tyy + old[1], tzz + old[2]), (rate[0][0], rate[1][1], rate[2][2]))
            + dot((txy + old[3], tyz + old[4], tzx + old[5]), (xy + yx, yz + zy, zx + xz))
        )
    work = 0.0
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            state.stress[cell, 0, k] = scratch[(at.STRESS + k) * LANES + lane]
        work += quantise(
            scratch[at.DEVIATOR_POWER * LANES + lane] * step * scratch[at.VOLUME * LANES + lane], grid.rounding
        )
    return work


@block_kernel
def sound_speeds(parameters: np.ndarray, scratch: np.ndarray) -> None:
    """Set sound speeds, and those that the step must allow for: while a cell may ignite, the products' at the front."""
    widest_vectors()
    front = FRONT_SOUND * parameters[7]
    for lane in range(LANES):
        density = scratch[at.MASS * LANES + lane] / scratch[at.VOLUME * LANES + lane]
        scratch[at.DENSITY * LANES + lane] = density
        sound = np.sqrt(scratch[at.GAS_STIFFNESS * LANES + lane] / density)
        scratch[at.SOUND * LANES + lane] = sound
        burnt = scratch[at.BURN * LANES + lane] >= 1.0
        scratch[at.FASTEST * LANES + lane] = sound if burnt else max(sound, front)


@inlined_kernel
def store(
    block: int, parameters: np.ndarray, grid: Grid, state: ChargeState, scratch: np.ndarray
) -> tuple[float, float]:
    """Write the cell state back; work of the pressure, and what viscosity turns to heat: the energy takes it up (J)."""
    widest_vectors()
    filled, rounding = grid.filled[block], grid.rounding
    for lane in range(LANES):
        change = scratch[at.VOLUME * LANES + lane] - scratch[at.OLD_VOLUME * LANES + lane]
        # Mean of both ends of the step, as the forces work: at the front q rises and falls within a few steps.
        viscous = scratch[at.OLD_VISCOUS * LANES + lane] + scratch[at.VISCOUS * LANES + lane]
        heating = -0.5 * viscous * change
        pressure = 0.5 * (scratch[at.OLD_GAS_PRESSURE * LANES + lane] + scratch[at.GAS_PRESSURE * LANES + lane])
        work = quantise(scratch[at.LEAKAGE * LANES + lane] * pressure * change, rounding)
        scratch[at.GAS_WORK * LANES + lane] = work if lane < filled else 0.0
        scratch[at.GAS_HEAT * LANES + lane] = quantise(heating, rounding) if lane < filled else 0.0
        # The shock's heat enters the products' energy a step late, but whole.
        scratch[at.GAS_ENERGY * LANES + lane] += heating * parameters[0] / scratch[at.MASS * LANES + lane]
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        state.pressure[cell] = scratch[at.GAS_PRESSURE * LANES + lane]
        state.burn_fraction[cell] = scratch[at.BURN * LANES + lane]
        state.energy[cell] = scratch[at.GAS_ENERGY * LANES + lane]
    return row_sum(scratch, at.GAS_WORK), row_sum(scratch, at.GAS_HEAT)


@block_kernel
def erode(block: int, parameters: np.ndarray, eroded: np.ndarray, scratch: np.ndarray) -> int:
    """Mark cells of products that have hardly any volume left; how many of the block are eroded."""
    slot, count = block * LANES, 0
    near = False
    for lane in range(LANES):  # no division for most blocks, which are far from it
        full = scratch[at.MIN_VOLUME * LANES + lane] * parameters[0]
        near |= (not full > _MAY_BE_CRUSHED * scratch[at.MASS * LANES + lane]) | (eroded[slot + lane] != WHOLE)
    if not near:
        return 0
    for lane in range(LANES):
        relative = scratch[at.MIN_VOLUME * LANES + lane] * parameters[0] / scratch[at.MASS * LANES + lane]
        if not relative > CRUSHED and scratch[at.BURN * LANES + lane] >= 1.0 and eroded[slot + lane] == WHOLE:
            eroded[slot + lane] = BEFORE
        count += 0 if eroded[slot + lane] == WHOLE else 1
    return count


@block_kernel
def clear_state(block: int, eroded: np.ndarray, scratch: np.ndarray) -> None:
    """Take pressure, which contact with the casing reads, strength and resistance from eroded cells."""
    for lane in range(LANES):
        if eroded[block * LANES + lane] != WHOLE:
            scratch[at.GAS_PRESSURE * LANES + lane] = 0.0
            clear_lane(scratch, lane)
