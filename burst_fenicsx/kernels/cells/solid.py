"""Casing and fuze: objective rate, Tresca return and softening at every point; element erosion of what is torn."""

from __future__ import annotations

from typing import Any

import numpy as np

from burst_fenicsx.kernels.cells.erosion import BEFORE, NOW, WHOLE, clear_lane
from burst_fenicsx.kernels.cells.objective_rate import elastic_trial, spin
from burst_fenicsx.kernels.cells.rows import (
    DISSIPATION,
    MASS,
    MATERIAL,
    RATE,
    SPRING,
    STORED_FORCE,
    STRENGTH,
    STRESS,
    VISCOUS,
    VOLUME,
)
from burst_fenicsx.kernels.constants import NOTHING_LEFT
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import Grid, SolidState
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.nodal_values import cells_of_lanes
from burst_fenicsx.kernels.vectors.tensors import (
    Symmetric,
    load_matrix,
    load_symmetric,
    store_symmetric,
    symmetric_square,
)
from burst_fenicsx.kernels.vectors.transposition import (
    WIDTH,
    address,
    later,
    load_triples,
    places,
    prefetch,
    store_triples,
)
from burst_fenicsx.materials.tresca import return_stress, softened_strength

__all__ = [
    "HAS_SPRINGS",
    "PARAMETERS",
    "clear_state",
    "elastic_energy",
    "elasticity",
    "erode",
    "is_elastic",
    "load",
    "load_point",
    "make_update",
    "moduli",
    "return_if_plastic",
    "return_plastic",
    "sound_speeds",
    "store",
    "store_point",
    "strengths",
    "total_stress",
]

PARAMETERS = (
    "modulus",
    "poisson",
    "tau",
    "sigma",
    "inverse_shear_limit",
    "inverse_volume_limit",
    "linear_viscosity",
    "quadratic_viscosity",
    "hourglass_viscous",
    "hourglass_stiffness",
    "density",
)
"""Columns of the table of solid materials (SI); an inverse limit of zero switches softening off."""

HAS_SPRINGS = True

_DENSITY = PARAMETERS.index("density")

_SHEAR_STRAIN, _VOLUME_STRAIN = MATERIAL + 6, MATERIAL + 7
_SOFTENING = MATERIAL + 8  # inverse factor on the limit strains

_STRESS_BYTES, _HALF_A_STRESS = np.uint64(48), np.uint64(24)  # of a point's stress


@lane_function
def is_elastic(stress: Symmetric, tau: float, sigma: float) -> bool:
    """Whether bounds without principal values show that a stress keeps within the strengths `tau` and `sigma` (Pa).

    (s1 - s3)/2 <= sqrt(J2) and s1 <= mean + 2 sqrt(J2/3).
    """
    xx, yy, zz, xy, yz, zx = stress
    mean = (xx + yy + zz) * (1.0 / 3.0)
    j2 = symmetric_square((xx - mean, yy - mean, zz - mean, xy, yz, zx))
    # The cut-off bound without a root: 4 J2 / 3 <= (sigma - mean)^2.
    room = max(sigma - mean, 0.0)
    return (j2 <= tau * tau) & ((4.0 / 3.0) * j2 <= room * room) & (mean <= sigma)


@lane_function
def return_if_plastic(
    stress: Symmetric, tau: float, sigma: float, modulus: float, poisson: float
) -> tuple[Symmetric, float, float, float]:
    """As `return_stress`, but what `is_elastic` finds elastic stays so, to the last bit.

    It does so in a block without plastic cells, and a cell's result must not depend on the other cells of its block.
    """
    elastic = is_elastic(stress, tau, sigma)
    return return_stress(stress, np.inf if elastic else tau, np.inf if elastic else sigma, modulus, poisson)


@block_kernel
def load(
    block: int,
    time: float,  # noqa: ARG001
    parameters: np.ndarray,  # noqa: ARG001
    grid: Grid,
    state: SolidState,
    scratch: np.ndarray,
) -> float:
    """Gather what a block's cells keep besides the state of their points; prefetch the next block's."""
    slot = block * LANES
    for lane in range(LANES):
        scratch[_SOFTENING * LANES + lane] = state.softening_scale[slot + lane]
        scratch[STRENGTH * LANES + lane] = 0.0
    for k in range(12 * LANES):
        scratch[STORED_FORCE * LANES + k] = state.hourglass[block, k]
    next_block = min(block + 1, len(grid.filled) - 1)
    start = address(state.hourglass) + np.uint64(next_block * 12 * LANES * 8)
    for line in range(12 * LANES * 8 // 64):
        prefetch(start + np.uint64(64 * line))
    start, stride = address(state.stress), _STRESS_BYTES * np.uint64(state.stress.shape[1])
    for lane in range(LANES):
        prefetch(start + stride * np.uint64(grid.cells[next_block, lane]))
    return 0.0


@block_kernel
def load_point(block: int, point: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Gather the state of one point of each cell into lanes."""
    points = np.uint64(state.stress.shape[1])
    start = address(state.stress) + _STRESS_BYTES * np.uint64(point)
    for first in range(0, LANES, WIDTH):
        stored = places(start, _STRESS_BYTES * points, cells_of_lanes(grid.cells[block], first))
        load_triples(stored, scratch, STRESS * LANES + first)
        load_triples(later(stored, _HALF_A_STRESS), scratch, (STRESS + 3) * LANES + first)
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        scratch[_SHEAR_STRAIN * LANES + lane] = state.shear_strain[cell, point]
        scratch[_VOLUME_STRAIN * LANES + lane] = state.volume_strain[cell, point]


@block_kernel
def store_point(block: int, point: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Write the state of one point of each cell back."""
    points = np.uint64(state.stress.shape[1])
    start = address(state.stress) + _STRESS_BYTES * np.uint64(point)
    # Lanes that repeat the block's last cell hold the same.
    for first in range(0, LANES, WIDTH):
        stored = places(start, _STRESS_BYTES * points, cells_of_lanes(grid.cells[block], first))
        store_triples(scratch, STRESS * LANES + first, stored)
        store_triples(scratch, (STRESS + 3) * LANES + first, later(stored, _HALF_A_STRESS))
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        state.shear_strain[cell, point] = scratch[_SHEAR_STRAIN * LANES + lane]
        state.volume_strain[cell, point] = scratch[_VOLUME_STRAIN * LANES + lane]


@lane_function
def moduli(material: np.ndarray) -> tuple[float, float]:
    """Shear modulus and Lame's first parameter (Pa)."""
    shear = 0.5 * material[0] / (1.0 + material[1])
    return shear, 2.0 * shear * material[1] / (1.0 - 2.0 * material[1])


@lane_function
def elastic_energy(stress: Symmetric, material: np.ndarray) -> float:
    """Elastic energy by volume (J/m3) of a stress (Pa)."""
    xx, yy, zz, xy, yz, zx = stress
    square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)
    trace = xx + yy + zz
    return 0.5 * (((1.0 + material[1]) * square - material[1] * trace * trace) / material[0])


@lane_function
def strengths(material: np.ndarray, scratch: np.ndarray, lane: int) -> tuple[float, float]:
    """Shear and tensile strength (Pa) after the strains so far."""
    scale = scratch[_SOFTENING * LANES + lane]
    tau = softened_strength(material[2], scratch[_SHEAR_STRAIN * LANES + lane], material[4] * scale)
    return tau, softened_strength(material[3], scratch[_VOLUME_STRAIN * LANES + lane], material[5] * scale)


def make_update(turn_stored: Any) -> Any:  # noqa: ANN401 - compiled functions
    """Kernel that advances the stress at a point of each cell; `turn_stored` is the hourglass control's."""

    @block_kernel
    def try_elastic(step: float, material: np.ndarray, scratch: np.ndarray) -> int:
        """Turn what is stored and add the elastic increment; count the cells that may be plastic."""
        widest_vectors()
        shear, lame = moduli(material)
        plastic = 0
        for lane in range(LANES):
            rate = load_matrix(scratch, RATE, lane)
            rotation = spin(rate, step)
            stress = elastic_trial(load_symmetric(scratch, STRESS, lane), rotation, rate, step, lame, shear)
            store_symmetric(stress, scratch, STRESS, lane)
            turn_stored(rotation, scratch, lane)
            tau, sigma = strengths(material, scratch, lane)
            plastic += 0 if is_elastic(stress, tau, sigma) else 1
            scratch[DISSIPATION * LANES + lane] = 0.0
        return plastic

    @block_kernel
    def update(
        block: int,  # noqa: ARG001
        step: float,
        stage: float,  # noqa: ARG001
        parameters: np.ndarray,
        grid: Grid,  # noqa: ARG001
        state: SolidState,
        scratch: np.ndarray,
        energy: np.ndarray,  # noqa: ARG001
    ) -> None:
        if try_elastic(step, parameters, scratch) > 0:
            return_plastic(parameters, scratch)
        if state.stress.shape[1] > 1:
            for lane in range(LANES):
                tau, _ = strengths(parameters, scratch, lane)
                scratch[STRENGTH * LANES + lane] = max(scratch[STRENGTH * LANES + lane], tau)

    return update


@block_kernel
def return_plastic(material: np.ndarray, scratch: np.ndarray) -> None:
    """Return the stresses of a block; those within the strengths stay as they are."""
    widest_vectors()
    for lane in range(LANES):
        tau, sigma = strengths(material, scratch, lane)
        stress, shear_strain, volume_strain, dissipation = return_if_plastic(
            load_symmetric(scratch, STRESS, lane), tau, sigma, material[0], material[1]
        )
        store_symmetric(stress, scratch, STRESS, lane)
        scratch[_SHEAR_STRAIN * LANES + lane] += shear_strain
        scratch[_VOLUME_STRAIN * LANES + lane] += volume_strain
        scratch[DISSIPATION * LANES + lane] = dissipation


@lane_function
def elasticity(parameters: np.ndarray) -> tuple[float, float]:
    """Modulus of a plane wave (Pa), and what is left of its speed without shear strength."""
    shear, lame = moduli(parameters)
    stiff = lame + 2.0 * shear
    return stiff, np.sqrt((lame + 2.0 / 3.0 * shear) / stiff)


@lane_function
def sound_speeds(
    density: float, constants: tuple[float, float], parameters: np.ndarray, scratch: np.ndarray, lane: int
) -> tuple[float, float]:
    """Sound speed, and the one that the step must allow for (m/s); `constants` are those of `elasticity`.

    Without shear strength only the bulk modulus answers, and the step may be longer by a quarter.
    """
    sound = np.sqrt(constants[0] / density)
    tau, _ = strengths(parameters, scratch, lane)
    return sound, sound if (tau > 0.0) | (scratch[STRENGTH * LANES + lane] > 0.0) else constants[1] * sound


@lane_function
def total_stress(scratch: np.ndarray, lane: int) -> Symmetric:
    """Stress with the viscous pressure taken off (Pa)."""
    viscous = scratch[VISCOUS * LANES + lane]
    xx, yy, zz, xy, yz, zx = load_symmetric(scratch, STRESS, lane)
    return xx - viscous, yy - viscous, zz - viscous, xy, yz, zx


@block_kernel
def store(
    block: int,
    step: float,  # noqa: ARG001
    parameters: np.ndarray,  # noqa: ARG001
    grid: Grid,
    state: SolidState,
    scratch: np.ndarray,
    energy: np.ndarray,
) -> None:
    """Write the stored hourglass forces back and add up the plastic work."""
    for k in range(12 * LANES):
        state.hourglass[block, k] = scratch[STORED_FORCE * LANES + k]
    plastic = 0.0
    for lane in range(grid.filled[block]):
        plastic += quantise(scratch[DISSIPATION * LANES + lane] * scratch[VOLUME * LANES + lane], grid.rounding)
    energy[0] += plastic


@block_kernel
def _is_spent(cell: int, parameters: np.ndarray, scale: float, state: SolidState) -> bool:
    """Whether the metal of a cell has lost its shear strength at every point; `scale` as in `strengths`."""
    for point in range(state.shear_strain.shape[1]):
        if softened_strength(parameters[2], state.shear_strain[cell, point], parameters[4] * scale) > 0.0:
            return False
    return parameters[2] > 0.0


@block_kernel
def erode(
    block: int,
    min_volume: int,
    parameters: np.ndarray,
    grid: Grid,
    state: SolidState,
    eroded: np.ndarray,
    scratch: np.ndarray,
) -> int:
    """Mark cells without strength of which hardly any volume is left; how many of the block are eroded.

    A cell is judged before its state advances, so that a shape out of which no finite number can come reaches no state.
    `min_volume` is a row of the scratch.
    """
    slot, count = block * LANES, 0
    for lane in range(LANES):
        if eroded[slot + lane] == WHOLE:
            volume = scratch[min_volume * LANES + lane] * parameters[_DENSITY]
            if not volume > NOTHING_LEFT * scratch[MASS * LANES + lane]:
                cell = np.uint64(grid.cells[block, lane])
                if _is_spent(cell, parameters, scratch[_SOFTENING * LANES + lane], state):
                    eroded[slot + lane] = NOW
        count += 0 if eroded[slot + lane] == WHOLE else 1
    return count


@block_kernel
def clear_state(
    block: int, grid: Grid, parameters: np.ndarray, state: SolidState, eroded: np.ndarray, scratch: np.ndarray
) -> None:
    """Take stress and resistance from eroded cells; what they hold elastically goes to the plastic work."""
    for lane in range(LANES):
        slot = block * LANES + lane
        if eroded[slot] == WHOLE:
            continue
        cell, points = np.uint64(grid.cells[block, lane]), state.stress.shape[1]
        scratch[DISSIPATION * LANES + lane] = 0.0
        for point in range(points):
            s = state.stress[cell, point]
            if eroded[slot] == NOW:
                stress = (s[0], s[1], s[2], s[3], s[4], s[5])
                scratch[DISSIPATION * LANES + lane] += elastic_energy(stress, parameters) / points
            if lane < grid.filled[block]:
                s[:] = 0.0
        eroded[slot] = BEFORE
        scratch[SPRING * LANES + lane] = 0.0
        for k in range(12):
            scratch[(STORED_FORCE + k) * LANES + lane] = 0.0
        clear_lane(scratch, lane)
