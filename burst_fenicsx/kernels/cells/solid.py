"""Casing and fuze: objective trial stress (Hughes and Winget 1980), plastic return, softening; torn metal is eroded."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from burst_fenicsx.kernels.axisymmetric import quadrilateral
from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells import one_point
from burst_fenicsx.kernels.cells.erosion import BEFORE, NOW, WHOLE, clear_lane
from burst_fenicsx.kernels.constants import NOTHING_LEFT
from burst_fenicsx.kernels.lanes import LANES, block_kernel, chosen, inlined_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.vectors.exact import quantise, row_sum
from burst_fenicsx.kernels.vectors.gather import load_slots
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    Symmetric,
    apply,
    dot,
    fma,
    load_matrix,
    load_symmetric,
    store_symmetric,
)
from burst_fenicsx.materials import laws

if TYPE_CHECKING:
    from types import ModuleType

    from burst_fenicsx.kernels.state import Grid, SolidState

_DENSITY, _LAW = at.SOLID_PARAMETERS.index("density"), at.SOLID_PARAMETERS.index("law")


@lane_function
def moduli(parameters: np.ndarray) -> tuple[float, float]:
    """Shear modulus and Lame's first parameter (Pa)."""
    shear = 0.5 * parameters[0] / (1.0 + parameters[1])
    return shear, 2.0 * shear * parameters[1] / (1.0 - 2.0 * parameters[1])


@lane_function
def elastic_energy(stress: Symmetric, parameters: np.ndarray) -> float:
    """Elastic energy by volume (J/m3) of a stress (Pa)."""
    xx, yy, zz, xy, yz, zx = stress
    square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)
    trace = xx + yy + zz
    return 0.5 * (((1.0 + parameters[1]) * square - parameters[1] * trace * trace) / parameters[0])


@lane_function
def spin(rate: Matrix, step: float) -> Matrix:
    """Rotation of the step after Hughes and Winget (1980): Q = (1 - w/2)^-1 (1 + w/2), w = spin times step.

    Exact for a rigid rotation of any size below half a turn, because the velocity gradient `rate` (1/s) is taken on the
    mid-step configuration.
    """
    # Half the rotation vector of w.
    x = 0.25 * step * (rate[2][1] - rate[1][2])
    y = 0.25 * step * (rate[0][2] - rate[2][0])
    z = 0.25 * step * (rate[1][0] - rate[0][1])
    xx, yy, zz = x * x, y * y, z * z
    f = 2.0 / (1.0 + xx + yy + zz)
    fx, fy, fz = f * x, f * y, f * z
    return (
        (1.0 - f * (yy + zz), fx * y - fz, fz * x + fy),
        (fx * y + fz, 1.0 - f * (zz + xx), fy * z - fx),
        (fz * x - fy, fy * z + fx, 1.0 - f * (xx + yy)),
    )


@lane_function
def elastic_trial(
    stress: Symmetric, rotation: Matrix, rate: Matrix, step: float, lame: float, shear: float
) -> Symmetric:
    """Rotate a stress and add the elastic increment: Q sigma Q^T + lambda tr(de) 1 + 2 G de.

    `stress` in Pa; `rate` is the velocity gradient (1/s); `lame` and `shear` moduli (Pa).
    """
    xx, yy, zz, xy, yz, zx = stress
    whole = ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz))
    qx, qy, qz = rotation
    # The stress is symmetric, so its products with the rows of Q are the rows of Q sigma.
    ax, ay, az = apply(whole, qx), apply(whole, qy), apply(whole, qz)
    twice, half = 2.0 * shear * step, shear * step
    pressure = lame * step * (rate[0][0] + rate[1][1] + rate[2][2])
    return (
        dot(ax, qx) + fma(twice, rate[0][0], pressure),
        dot(ay, qy) + fma(twice, rate[1][1], pressure),
        dot(az, qz) + fma(twice, rate[2][2], pressure),
        fma(half, rate[0][1] + rate[1][0], dot(ax, qy)),
        fma(half, rate[1][2] + rate[2][1], dot(ay, qz)),
        fma(half, rate[2][0] + rate[0][2], dot(az, qx)),
    )


@inlined_kernel
def load(block: int, state: SolidState, scratch: np.ndarray) -> None:
    """Gather what a block's cells keep besides the state of their points."""
    load_slots(block, state.softening_scale, scratch[at.SOFTENING * LANES :])
    for lane in range(LANES):
        scratch[at.STRENGTH * LANES + lane] = scratch[at.PRESSURE * LANES + lane] = 0.0
    for k in range(state.hourglass.shape[1]):
        scratch[at.HOURGLASS_STORED * LANES + k] = state.hourglass[block, k]


@inlined_kernel
def load_point(block: int, point: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Gather the state of one point of each cell."""
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            scratch[(at.STRESS + k) * LANES + lane] = state.stress[cell, point, k]
        scratch[at.SHEAR_STRAIN * LANES + lane] = state.shear_strain[cell, point]
        scratch[at.VOLUME_STRAIN * LANES + lane] = state.volume_strain[cell, point]


@inlined_kernel
def store_point(block: int, point: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Write the state of one point of each cell back."""
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            state.stress[cell, point, k] = scratch[(at.STRESS + k) * LANES + lane]
        state.shear_strain[cell, point] = scratch[at.SHEAR_STRAIN * LANES + lane]
        state.volume_strain[cell, point] = scratch[at.VOLUME_STRAIN * LANES + lane]


@block_kernel
def trial_stress(element: tuple[int, ...], step: float, parameters: np.ndarray, scratch: np.ndarray) -> None:
    """Turn the stress, and what hourglass control has stored, with the cell, and add the elastic increment."""
    widest_vectors()
    shear, lame = moduli(parameters)
    for lane in range(LANES):
        rate = load_matrix(scratch, at.RATE, lane)
        rotation = spin(rate, step)
        old = load_symmetric(scratch, at.STRESS, lane)
        store_symmetric(elastic_trial(old, rotation, rate, step, lame, shear), scratch, at.STRESS, lane)
        scratch[at.DISSIPATION * LANES + lane] = 0.0
        if len(element) == 1:  # known while compiling
            one_point.turn_stored(rotation, scratch, lane)
        elif len(element) == 2:
            quadrilateral.turn_stored(rotation, scratch, lane)


def _returning(law: ModuleType) -> Any:  # noqa: ANN401 - compiled functions
    strengths, is_elastic, return_stress = law.strengths, law.is_elastic, law.return_stress

    @block_kernel
    def return_plastic(parameters: np.ndarray, scratch: np.ndarray) -> None:
        """Return the stresses of a block.

        What `is_elastic` finds elastic stays as it is, to the last bit: it does so in a block without plastic cells,
        and a cell's result must not depend on the other cells of its block.
        """
        widest_vectors()
        for lane in range(LANES):
            shear_strain = scratch[at.SHEAR_STRAIN * LANES + lane]
            volume_strain = scratch[at.VOLUME_STRAIN * LANES + lane]
            scale = scratch[at.SOFTENING * LANES + lane]
            tau, sigma = strengths(parameters, shear_strain, volume_strain, scale)
            trial = load_symmetric(scratch, at.STRESS, lane)
            elastic = is_elastic(trial, tau, sigma)
            stress, more_shear, more_volume, dissipation = return_stress(
                trial, np.inf if elastic else tau, np.inf if elastic else sigma, parameters[0], parameters[1]
            )
            store_symmetric(stress, scratch, at.STRESS, lane)
            scratch[at.SHEAR_STRAIN * LANES + lane] = shear_strain + more_shear
            scratch[at.VOLUME_STRAIN * LANES + lane] = volume_strain + more_volume
            scratch[at.DISSIPATION * LANES + lane] = dissipation

    @block_kernel
    def return_block(parameters: np.ndarray, scratch: np.ndarray) -> None:
        """Return the trial stresses at a point of a block's cells to their strengths, where any may exceed them."""
        widest_vectors()
        plastic = 0
        for lane in range(LANES):
            tau, sigma = strengths(
                parameters,
                scratch[at.SHEAR_STRAIN * LANES + lane],
                scratch[at.VOLUME_STRAIN * LANES + lane],
                scratch[at.SOFTENING * LANES + lane],
            )
            plastic += 0 if is_elastic(load_symmetric(scratch, at.STRESS, lane), tau, sigma) else 1
        if plastic > 0:
            return_plastic(parameters, scratch)
        for lane in range(LANES):
            tau, _ = strengths(
                parameters,
                scratch[at.SHEAR_STRAIN * LANES + lane],
                scratch[at.VOLUME_STRAIN * LANES + lane],
                scratch[at.SOFTENING * LANES + lane],
            )
            scratch[at.STRENGTH * LANES + lane] = max(scratch[at.STRENGTH * LANES + lane], tau)

    return return_block


def _spending(law: ModuleType) -> Any:  # noqa: ANN401
    strengths = law.strengths

    @block_kernel
    def is_spent(parameters: np.ndarray, cell: int, scale: float, state: SolidState) -> bool:
        """Whether the metal of a cell has lost its shear strength at every point; `scale` that of softening."""
        for point in range(state.shear_strain.shape[1]):
            tau, _ = strengths(parameters, state.shear_strain[cell, point], state.volume_strain[cell, point], scale)
            if tau > 0.0:
                return False
        tau, _ = strengths(parameters, 0.0, 0.0, scale)
        return tau > 0.0

    return is_spent


return_stress = chosen([_returning(law) for law in laws("solids")], _LAW)
_is_spent = chosen([_spending(law) for law in laws("solids")], _LAW)


@block_kernel
def sound_speeds(parameters: np.ndarray, scratch: np.ndarray) -> float:
    """Set sound speeds, and those that the step must allow for; modulus of a plane wave (Pa).

    Without shear strength only the bulk modulus answers, and the step may be longer by a quarter.
    """
    widest_vectors()
    shear, lame = moduli(parameters)
    stiff = lame + 2.0 * shear
    weak = np.sqrt((lame + 2.0 / 3.0 * shear) / stiff)
    for lane in range(LANES):
        density = scratch[at.MASS * LANES + lane] / scratch[at.VOLUME * LANES + lane]
        scratch[at.DENSITY * LANES + lane] = density
        sound = np.sqrt(stiff / density)
        scratch[at.SOUND * LANES + lane] = sound
        scratch[at.FASTEST * LANES + lane] = sound if scratch[at.STRENGTH * LANES + lane] > 0.0 else weak * sound
    return stiff


@inlined_kernel
def store(block: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> float:
    """Write the stored hourglass forces back; plastic work (J) of the lanes that hold a cell."""
    widest_vectors()
    for k in range(state.hourglass.shape[1]):
        state.hourglass[block, k] = scratch[at.HOURGLASS_STORED * LANES + k]
    filled, rounding = grid.filled[block], grid.rounding
    for lane in range(LANES):
        work = scratch[at.DISSIPATION * LANES + lane] * scratch[at.VOLUME * LANES + lane]
        scratch[at.PLASTIC * LANES + lane] = quantise(work, rounding) if lane < filled else 0.0
    return row_sum(scratch, at.PLASTIC)


@inlined_kernel
def erode(block: int, parameters: np.ndarray, grid: Grid, state: SolidState, scratch: np.ndarray) -> int:
    """Mark cells without strength of which hardly any volume is left; how many of the block are eroded.

    A cell is judged before its state advances, so that a shape out of which no finite number can come reaches no state.
    """
    slot, count = block * LANES, 0
    for lane in range(LANES):
        if state.eroded[slot + lane] == WHOLE:
            mass = scratch[at.MIN_VOLUME * LANES + lane] * parameters[_DENSITY]
            if not mass > NOTHING_LEFT * scratch[at.MASS * LANES + lane]:
                cell = np.uint64(grid.cells[block, lane])
                if _is_spent(parameters, cell, scratch[at.SOFTENING * LANES + lane], state):
                    state.eroded[slot + lane] = NOW
        count += 0 if state.eroded[slot + lane] == WHOLE else 1
    return count


@inlined_kernel
def clear_state(block: int, parameters: np.ndarray, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Take stress and resistance from eroded cells; what they hold elastically goes to the plastic work."""
    for lane in range(LANES):
        slot = block * LANES + lane
        if state.eroded[slot] == WHOLE:
            continue
        cell, points = np.uint64(grid.cells[block, lane]), state.stress.shape[1]
        scratch[at.DISSIPATION * LANES + lane] = 0.0
        for point in range(points):
            s = state.stress[cell, point]
            if state.eroded[slot] == NOW:
                stress = (s[0], s[1], s[2], s[3], s[4], s[5])
                scratch[at.DISSIPATION * LANES + lane] += elastic_energy(stress, parameters) / points
            if lane < grid.filled[block]:
                s[:] = 0.0
        state.eroded[slot] = BEFORE
        scratch[at.SPRING * LANES + lane] = 0.0
        for k in range(12):
            scratch[(at.HOURGLASS_STORED + k) * LANES + lane] = 0.0
        clear_lane(scratch, lane)
