"""One-point cells of casing and fuze: objective rate, Tresca return, hourglass control, nodal forces."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells.common import (
    COEFFICIENT_LIMIT,
    DAMPING,
    FORCE,
    FREE,
    FREQUENCY,
    HOURGLASS,
    MASS,
    MOST_DAMPED,
    POWER,
    RATE,
    STABLE,
    VISCOUS,
    VOLUME,
    force_modes,
    lower_limits,
    may_overdo,
    trace_of_rate,
    viscosity_and_step,
)
from burst_fenicsx.kernels.cells.hexahedron import store_nodal_forces
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import Grid, SolidState
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.nodal_values import cells_of_lanes
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    Symmetric,
    Vector,
    add_scaled,
    apply,
    dot,
    fma,
    load_matrix,
    load_symmetric,
    load_vector,
    store_symmetric,
    store_vector,
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
    "DISSIPATION",
    "PARAMETERS",
    "SCRATCH_ROWS",
    "SPRING",
    "STORED",
    "STRESS",
    "add_work",
    "elastic_energy",
    "elastic_trial",
    "is_elastic",
    "load_state",
    "moduli",
    "resist_mode",
    "return_if_plastic",
    "return_plastic",
    "spin",
    "store_state",
    "strengths",
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
)
"""Columns of the table of solid materials (SI); an inverse limit of zero switches softening off."""

_MOST_STIFF = 0.25  # square of the hourglass springs' frequency times the step

SCRATCH_ROWS = 160
"""Rows of `LANES` doubles that a block of any kind needs."""


STRESS = FREE  # 6 rows, Pa
_SHEAR_STRAIN, _VOLUME_STRAIN = FREE + 6, FREE + 7
_SOFTENING = FREE + 8  # inverse factor on the limit strains
DISSIPATION = FREE + 9  # J/m3 in this step
SPRING = FREE + 10  # hourglass springs' coefficient times the step, N s/m
STORED = FREE + 11  # stored elastic hourglass forces, 12 rows, N

_STRESS_BYTES, _HALF_A_STRESS = np.uint64(48), np.uint64(24)  # of a cell's stress


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
def load_state(block: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Gather the cell state into lanes."""
    slot = block * LANES
    start = address(state.stress)
    for first in range(0, LANES, WIDTH):
        stored = places(start, _STRESS_BYTES, cells_of_lanes(grid.cells[block], first))
        load_triples(stored, scratch, STRESS * LANES + first)
        load_triples(later(stored, _HALF_A_STRESS), scratch, (STRESS + 3) * LANES + first)
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        scratch[_SHEAR_STRAIN * LANES + lane] = state.shear_strain[cell, 0]
        scratch[_VOLUME_STRAIN * LANES + lane] = state.volume_strain[cell, 0]
        scratch[_SOFTENING * LANES + lane] = state.softening_scale[slot + lane]
        scratch[MASS * LANES + lane] = grid.mass[slot + lane]
    for k in range(12 * LANES):
        scratch[STORED * LANES + k] = state.hourglass[block, k]


@block_kernel
def fetch_next(block: int, grid: Grid, state: SolidState) -> None:
    """Prefetch the cell state of the next block while this block is computed."""
    next_block = min(block + 1, len(grid.filled) - 1)
    start = address(state.hourglass) + np.uint64(next_block * 12 * LANES * 8)
    for line in range(12 * LANES * 8 // 64):
        prefetch(start + np.uint64(64 * line))
    start = address(state.stress)
    for lane in range(LANES):
        prefetch(start + _STRESS_BYTES * np.uint64(grid.cells[next_block, lane]))


@block_kernel
def store_state(block: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Write the cell state back."""
    start = address(state.stress)
    # Lanes that repeat the block's last cell hold the same.
    for first in range(0, LANES, WIDTH):
        stored = places(start, _STRESS_BYTES, cells_of_lanes(grid.cells[block], first))
        store_triples(scratch, STRESS * LANES + first, stored)
        store_triples(scratch, (STRESS + 3) * LANES + first, later(stored, _HALF_A_STRESS))
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        state.shear_strain[cell, 0] = scratch[_SHEAR_STRAIN * LANES + lane]
        state.volume_strain[cell, 0] = scratch[_VOLUME_STRAIN * LANES + lane]
    for k in range(12 * LANES):
        state.hourglass[block, k] = scratch[STORED * LANES + k]


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
        store_vector(apply(rotation, load_vector(scratch, STORED, lane)), scratch, STORED, lane)
        store_vector(apply(rotation, load_vector(scratch, STORED + 3, lane)), scratch, STORED + 3, lane)
        store_vector(apply(rotation, load_vector(scratch, STORED + 6, lane)), scratch, STORED + 6, lane)
        store_vector(apply(rotation, load_vector(scratch, STORED + 9, lane)), scratch, STORED + 9, lane)
        tau, sigma = strengths(material, scratch, lane)
        plastic += 0 if is_elastic(stress, tau, sigma) else 1
        scratch[DISSIPATION * LANES + lane] = 0.0
    return plastic


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


@block_kernel
def stiffen(step: float, next_dt: float, material: np.ndarray, scratch: np.ndarray) -> int:
    """Artificial viscosity, stable steps and hourglass coefficients; count the cells that may not bear the latter.

    Flanagan and Belytschko (1981), Eq. 59-62. The viscous coefficient multiplies rho c V/L / 4; the stiffness is
    given as a fraction of what full integration would give, about rho c^2 L / 36. The limits depend on the
    next step, `next_dt` (s).
    """
    widest_vectors()
    shear, lame = moduli(material)
    stiff = lame + 2.0 * shear
    # Without shear strength only the bulk modulus answers, and the step may be longer by a quarter.
    softened = np.sqrt((lame + 2.0 / 3.0 * shear) / stiff)
    per_mass = 1.0 / (8.0 * next_dt) if next_dt > 0.0 else np.inf
    count = 0
    for lane in range(LANES):
        volume, frequency = scratch[VOLUME * LANES + lane], scratch[FREQUENCY * LANES + lane]
        mass = scratch[MASS * LANES + lane]
        density = mass / volume
        sound = np.sqrt(stiff / density)
        tau, _ = strengths(material, scratch, lane)
        fastest = sound if tau > 0.0 else softened * sound
        length = 1.0 / frequency
        viscous, stable = viscosity_and_step(
            trace_of_rate(scratch, lane), length, density, sound, fastest, material[6], material[7]
        )
        damping = 0.25 * material[8] * mass * sound * frequency
        spring = material[9] / 36.0 * stiff * step * length
        scratch[VISCOUS * LANES + lane] = viscous
        scratch[STABLE * LANES + lane] = stable
        scratch[DAMPING * LANES + lane] = damping
        scratch[SPRING * LANES + lane] = spring
        most = max(damping * (1.0 / MOST_DAMPED), spring * (1.0 / _MOST_STIFF))
        count += 1 if may_overdo(most, mass * per_mass, scratch, lane) else 0
    return count


@block_kernel
def resist(share: float, rounding: float, scratch: np.ndarray) -> None:
    """Nodal forces of the stresses, the artificial viscosity and the hourglass control."""
    widest_vectors()
    for lane in range(LANES):
        h3, p3 = resist_mode(0, scratch, lane)
        h5, p5 = resist_mode(1, scratch, lane)
        h6, p6 = resist_mode(2, scratch, lane)
        h7, p7 = resist_mode(3, scratch, lane)
        scratch[POWER * LANES + lane] = p3 + p5 + p6 + p7
        viscous = scratch[VISCOUS * LANES + lane]
        xx, yy, zz, xy, yz, zx = load_symmetric(scratch, STRESS, lane)
        stress = (xx - viscous, yy - viscous, zz - viscous, xy, yz, zx)
        store_nodal_forces(force_modes(stress, (h3, h5, h6, h7), scratch, lane), share, rounding, scratch, FORCE, lane)


@lane_function
def resist_mode(a: int, scratch: np.ndarray, lane: int) -> tuple[Vector, float]:
    """Force (N) against one hourglass mode, viscous + stored elastic one, and its power (W).

    Both are bounded by what the step lets a cell bear whose hourglass vectors its distortion has made long. The stored
    forces have been turned with the cell; they are advanced.
    """
    rate = load_vector(scratch, HOURGLASS + 3 * a, lane)
    coefficient_limit = scratch[(COEFFICIENT_LIMIT + a) * LANES + lane]
    spring = min(scratch[SPRING * LANES + lane], _MOST_STIFF * coefficient_limit)
    elastic = add_scaled(load_vector(scratch, STORED + 3 * a, lane), spring, rate)
    store_vector(elastic, scratch, STORED + 3 * a, lane)
    force = add_scaled(elastic, min(scratch[DAMPING * LANES + lane], MOST_DAMPED * coefficient_limit), rate)
    return force, dot(force, rate)


@block_kernel
def add_work(
    block: int,
    step: float,
    share: float,
    grid: Grid,
    scratch: np.ndarray,
    energy: np.ndarray,
    limits: np.ndarray,
) -> None:
    """Add up the work of the step and find the limits; arguments as for `solid_block`."""
    slot = block * LANES
    plastic = viscous_work = hourglass = 0.0
    for lane in range(grid.filled[block]):
        volume, viscous = scratch[VOLUME * LANES + lane], scratch[VISCOUS * LANES + lane]
        stable = scratch[STABLE * LANES + lane]
        plastic += quantise(scratch[DISSIPATION * LANES + lane] * volume, grid.rounding)
        # Mean of both ends of the step, as the forces work: at a front q changes within it.
        work = 0.5 * (grid.viscous[slot + lane] + viscous) * (volume - grid.volume[slot + lane])
        viscous_work -= quantise(work, grid.rounding)
        hourglass += quantise(scratch[POWER * LANES + lane] * step, grid.rounding)
        grid.viscous[slot + lane] = viscous
        grid.stable[slot + lane] = stable
        grid.volume[slot + lane] = volume
        lower_limits(grid.cells[block, lane], stable, volume, share, limits)
    energy[0] += plastic
    energy[1] += viscous_work
    energy[2] += hourglass
