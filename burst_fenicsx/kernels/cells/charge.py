"""The charge: burnt fraction, pressure, strength of what has not reacted; element erosion of crushed products."""

from __future__ import annotations

from typing import Any

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.charge_pressure import burn_by_compression
from burst_fenicsx.kernels.cells.elastic import elastic_trial, spin
from burst_fenicsx.kernels.cells.erosion import BEFORE, WHOLE, clear_lane
from burst_fenicsx.kernels.constants import CRUSHED, FRONT_SOUND
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import ChargeState, Grid
from burst_fenicsx.kernels.vectors.exact import quantise, row_sum
from burst_fenicsx.kernels.vectors.tensors import (
    Symmetric,
    dot,
    load_matrix,
    load_symmetric,
    scaled,
    store_symmetric,
    symmetric_square,
)
from burst_fenicsx.kernels.vectors.transposition import WIDTH, address, prefetch
from burst_fenicsx.materials import laws

__all__ = [
    "HAS_SPRINGS",
    "PARAMETERS",
    "clear_state",
    "elasticity",
    "erode",
    "load",
    "make_update",
    "prefetch_state",
    "sound_speeds",
    "store",
    "total_stress",
]

PARAMETERS, HAS_SPRINGS = at.CHARGE_PARAMETERS, False

_MAY_BE_CRUSHED = 1.001 * CRUSHED  # relative volume above which no rounding makes a cell crushed
_MODEL = at.CHARGE_PARAMETERS.index("model")


def _choose_press() -> Any:  # noqa: ANN401 - compiled functions
    """Kernel that asks the model of a block's charge for its pressure."""

    def before(number: int, press: Any, others: Any) -> Any:  # noqa: ANN401
        @block_kernel
        def choose(parameters: np.ndarray, scratch: np.ndarray) -> None:
            if parameters[_MODEL] == number:
                press(parameters, scratch)
            else:
                others(parameters, scratch)

        return choose

    *first, last = (model.press for model in laws("products"))
    for number in reversed(range(len(first))):
        last = before(number, first[number], last)
    return last


_press = _choose_press()


@block_kernel
def load(block: int, time: float, parameters: np.ndarray, grid: Grid, state: ChargeState, scratch: np.ndarray) -> float:
    """Gather the cell state into lanes and burn cells as far as time does.

    Returns the smallest fraction burnt before. Where all is burnt, the row of burning by compression is not set.
    """
    by_compression, min_burn = parameters[8], 1.0
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        burn = state.burn_fraction[cell]
        min_burn = min(min_burn, burn)
        scratch[at.CHARGE_BURN * LANES + lane] = burn
        scratch[at.CHARGE_OLD_PRESSURE * LANES + lane] = state.pressure[cell]
        scratch[at.CHARGE_ENERGY * LANES + lane] = state.energy[cell]
        scratch[at.CHARGE_LEAKAGE * LANES + lane] = state.leakage[np.uint64(state.axial_slice[cell])]
    for k in range(6 * LANES):
        scratch[at.STRESS * LANES + k] = 0.0
    if min_burn < 1.0:
        for lane in range(LANES):
            cell = np.uint64(grid.cells[block, lane])
            by_time = (time - state.ignition_time[cell]) * state.burn_rate[cell]
            scratch[at.CHARGE_BURN * LANES + lane] = max(scratch[at.CHARGE_BURN * LANES + lane], min(by_time, 1.0))
            scratch[at.CHARGE_BY_COMPRESSION * LANES + lane] = (
                by_compression if time >= state.compression_from[cell] else 0.0
            )
    return min_burn


def make_update(turn_stored: Any) -> Any:  # noqa: ANN401, ARG001 - a charge's hourglass control stores no force
    """Kernel that burns a block's cells by compression, finds their pressure and the strength of what is unreacted."""

    @block_kernel
    def update(
        block: int,
        step: float,
        stage: float,
        parameters: np.ndarray,
        grid: Grid,
        state: ChargeState,
        scratch: np.ndarray,
        energy: np.ndarray,
    ) -> None:
        """`stage` is the smallest fraction burnt before, as `load` gives it."""
        if stage < 1.0:
            burn_by_compression(parameters, scratch)
        _press(parameters, scratch)
        # The step in which a cell burns out still takes its deviator to zero.
        if stage < 1.0:
            _hold_by_strength(block, step, parameters, grid, state, scratch, energy)

    return update


@block_kernel
def _hold_by_strength(
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
            scratch[(at.CHARGE_OLD_DEVIATOR + k) * LANES + lane] = state.stress[cell, 0, k]
    for lane in range(LANES):
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = load_matrix(scratch, at.RATE, lane)
        mean = (xx + yy + zz) * (1.0 / 3.0)
        rate = ((xx - mean, xy, xz), (yx, yy - mean, yz), (zx, zy, zz - mean))
        old = load_symmetric(scratch, at.CHARGE_OLD_DEVIATOR, lane)
        trial = elastic_trial(old, spin(rate, step), rate, step, 0.0, material[2])
        norm = np.sqrt(symmetric_square(trial))
        limit = (1.0 - scratch[at.CHARGE_BURN * LANES + lane]) * material[3]
        factor = limit / norm if norm > limit else 1.0
        txx, tyy, tzz = scaled(factor, (trial[0], trial[1], trial[2]))
        txy, tyz, tzx = scaled(factor, (trial[3], trial[4], trial[5]))
        store_symmetric((txx, tyy, tzz, txy, tyz, tzx), scratch, at.STRESS, lane)
        scratch[at.CHARGE_POWER * LANES + lane] = 0.5 * (
            dot((txx + old[0], tyy + old[1], tzz + old[2]), (rate[0][0], rate[1][1], rate[2][2]))
            + dot((txy + old[3], tyz + old[4], tzx + old[5]), (xy + yx, yz + zy, zx + xz))
        )
    work = 0.0
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            state.stress[cell, 0, k] = scratch[(at.STRESS + k) * LANES + lane]
        work += quantise(
            scratch[at.CHARGE_POWER * LANES + lane] * step * scratch[at.VOLUME * LANES + lane], grid.rounding
        )
    energy[0] += work


@lane_function
def elasticity(parameters: np.ndarray) -> tuple[float]:
    """Products' sound speed at the front (m/s): while a cell may still ignite, the step allows for it."""
    return (FRONT_SOUND * parameters[7],)


@lane_function
def sound_speeds(
    density: float,
    constants: tuple[float],
    parameters: np.ndarray,  # noqa: ARG001
    scratch: np.ndarray,
    lane: int,
) -> tuple[float, float]:
    """Sound speed, and the one that the step must allow for (m/s); `constants` are those of `elasticity`."""
    sound = np.sqrt(scratch[at.CHARGE_STIFFNESS * LANES + lane] / density)
    return sound, max(sound, constants[0]) if scratch[at.CHARGE_BURN * LANES + lane] < 1.0 else sound


@lane_function
def total_stress(scratch: np.ndarray, lane: int) -> Symmetric:
    """Deviator less vented and viscous pressure (Pa)."""
    xx, yy, zz, xy, yz, zx = load_symmetric(scratch, at.STRESS, lane)
    pressure = (
        scratch[at.CHARGE_LEAKAGE * LANES + lane] * scratch[at.CHARGE_PRESSURE * LANES + lane]
        + scratch[at.VISCOUS * LANES + lane]
    )
    return xx - pressure, yy - pressure, zz - pressure, xy, yz, zx


@block_kernel
def _find_work(filled: int, rounding: float, parameters: np.ndarray, scratch: np.ndarray) -> None:
    """Work of the pressure and what viscosity turns to heat, which the energy takes up, of lanes that hold a cell."""
    widest_vectors()
    for lane in range(LANES):
        change = scratch[at.VOLUME * LANES + lane] - scratch[at.OLD_VOLUME * LANES + lane]
        # Mean of both ends of the step, as the forces work: at the front q rises and falls within a few steps.
        viscous = scratch[at.OLD_VISCOUS * LANES + lane] + scratch[at.VISCOUS * LANES + lane]
        heating = -0.5 * viscous * change
        pressure = 0.5 * (scratch[at.CHARGE_OLD_PRESSURE * LANES + lane] + scratch[at.CHARGE_PRESSURE * LANES + lane])
        work = quantise(scratch[at.CHARGE_LEAKAGE * LANES + lane] * pressure * change, rounding)
        scratch[at.PRODUCTS_WORK * LANES + lane] = work if lane < filled else 0.0
        scratch[at.PRODUCTS_HEAT * LANES + lane] = quantise(heating, rounding) if lane < filled else 0.0
        # The shock's heat enters the products' energy a step late, but whole.
        scratch[at.CHARGE_ENERGY * LANES + lane] += heating * parameters[0] / scratch[at.MASS * LANES + lane]


@block_kernel
def store(
    block: int,
    step: float,  # noqa: ARG001
    parameters: np.ndarray,
    grid: Grid,
    state: ChargeState,
    scratch: np.ndarray,
    energy: np.ndarray,
) -> None:
    """Write the cell state back and add up the work of the pressure and what viscosity turns to heat."""
    _find_work(grid.filled[block], grid.rounding, parameters, scratch)
    energy[3] += row_sum(scratch, at.PRODUCTS_WORK)
    energy[4] += row_sum(scratch, at.PRODUCTS_HEAT)
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        state.pressure[cell] = scratch[at.CHARGE_PRESSURE * LANES + lane]
        state.burn_fraction[cell] = scratch[at.CHARGE_BURN * LANES + lane]
        state.energy[cell] = scratch[at.CHARGE_ENERGY * LANES + lane]


@block_kernel
def prefetch_state(block: int, grid: Grid, state: ChargeState) -> None:
    """Bring a block's state near: its cells mostly follow one another."""
    for lane in (0, WIDTH, LANES - 1):
        later_by = np.uint64(8) * np.uint64(grid.cells[block, lane])
        prefetch(address(state.burn_fraction) + later_by)
        prefetch(address(state.pressure) + later_by)
        prefetch(address(state.energy) + later_by)


@block_kernel
def erode(
    block: int,
    min_volume: int,
    parameters: np.ndarray,
    grid: Grid,  # noqa: ARG001
    state: ChargeState,  # noqa: ARG001
    eroded: np.ndarray,
    scratch: np.ndarray,
) -> int:
    """Mark cells of products that have hardly any volume left; how many of the block are eroded."""
    slot, count = block * LANES, 0
    near = False
    for lane in range(LANES):  # no division for most blocks, which are far from it
        full = scratch[min_volume * LANES + lane] * parameters[0]
        near |= (not full > _MAY_BE_CRUSHED * scratch[at.MASS * LANES + lane]) | (eroded[slot + lane] != WHOLE)
    if not near:
        return 0
    for lane in range(LANES):
        relative = scratch[min_volume * LANES + lane] * parameters[0] / scratch[at.MASS * LANES + lane]
        if not relative > CRUSHED and scratch[at.CHARGE_BURN * LANES + lane] >= 1.0 and eroded[slot + lane] == WHOLE:
            eroded[slot + lane] = BEFORE
        count += 0 if eroded[slot + lane] == WHOLE else 1
    return count


@block_kernel
def clear_state(
    block: int,
    grid: Grid,  # noqa: ARG001
    parameters: np.ndarray,  # noqa: ARG001
    state: ChargeState,  # noqa: ARG001
    eroded: np.ndarray,
    scratch: np.ndarray,
) -> None:
    """Take pressure, which contact with the casing reads, strength and resistance from eroded cells."""
    for lane in range(LANES):
        if eroded[block * LANES + lane] != WHOLE:
            scratch[at.CHARGE_PRESSURE * LANES + lane] = 0.0
            clear_lane(scratch, lane)
