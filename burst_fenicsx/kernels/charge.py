"""Kernel of the charge: burn fraction, products' pressure, unreacted explosive, hourglass control, nodal forces."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.common import (
    COEFFICIENT_LIMIT,
    DAMPING,
    FORCE,
    FREE,
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
from burst_fenicsx.kernels.exact import quantise
from burst_fenicsx.kernels.hexahedron import add_nodal_forces, gather, store_nodal_forces
from burst_fenicsx.kernels.lanes import LANES, block_kernel, inlined_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.solid import elastic_trial, spin
from burst_fenicsx.kernels.state import ChargeState, Grid, Nodes
from burst_fenicsx.kernels.tensors import (
    dot,
    load_matrix,
    load_symmetric,
    load_vector,
    scaled,
    store_symmetric,
    store_vector,
    symmetric_square,
)
from burst_fenicsx.kernels.torn_metal import BEFORE, WHOLE, drop_forces

__all__ = [
    "BURN",
    "CRUSHED",
    "LEAKAGE",
    "PARAMETERS",
    "PRESSURE",
    "STIFFNESS",
    "STRESS",
    "add_work",
    "burn_by_compression",
    "charge_block",
    "hold_by_strength",
    "load_state",
    "press_by_jwl",
    "press_by_landau",
]

PARAMETERS = (
    "density",
    "unreacted_bulk_modulus",
    "unreacted_shear_modulus",
    "unreacted_strength",
    "linear_viscosity",
    "quadratic_viscosity",
    "hourglass_viscous",
    "detonation_velocity",
    "burn_by_compression",
    "model",
    "P0",
    "Pk",
    "Vk",
    "A",
    "B",
    "R1",
    "R2",
    "omega",
    "hugoniot_slope",
    "hugoniot_limit",
)
"""Columns of the table of explosives (SI). `model` is 0 for an isentrope of Landau and Stanyukovich (P0, Pk, Vk), 1 for
Jones-Wilkins-Lee (A to omega). `burn_by_compression` is 1/(1 - V_CJ/V0), or 0 for burning by time alone.
`hugoniot_limit` is the largest rho/rho0 - 1 up to which the unreacted explosive follows its Hugoniot."""


CRUSHED = 0.3
"""Volume of products over that of the charge below which nothing real presses them: with gamma 3 they have 16 times the
pressure of Chapman and Jouguet there."""

_ZERO = (0.0, 0.0, 0.0)

STRESS = FREE  # deviator of the unreacted charge, 6 rows, Pa
_STORED = FREE + 6  # the same before the step
_OLD_VOLUME = FREE + 12  # m3
_OLD_PRESSURE, PRESSURE = FREE + 13, FREE + 14  # of the whole cell before leakage, Pa
BURN = FREE + 15  # burnt fraction
_BY_COMPRESSION = FREE + 16  # burnt fraction over the compression
_CONTENT = FREE + 17  # internal energy of the products, J/m3 of initial volume
LEAKAGE = FREE + 18
STIFFNESS = FREE + 19  # -V dP/dV, Pa
_HELD = FREE + 20  # power of the deviator, W/m3


@lane_function
def _inverse_cube_root(x: float) -> np.float64:
    """x^(-1/3) by Newton's iteration from a guess made on the exponent; vectorises where a power does not."""
    bits = np.float64(x).view(np.int64)
    third = (bits >> 2) + (bits >> 4) + (bits >> 6) + (bits >> 8) + (bits >> 10) + (bits >> 12) + (bits >> 14)
    y = np.int64(6142909891733356544 - third).view(np.float64)
    for _ in range(5):
        y *= (4.0 - x * y * y * y) * (1.0 / 3.0)
    return y


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
        scratch[_OLD_PRESSURE * LANES + lane] = state.pressure[cell]
        scratch[_CONTENT * LANES + lane] = state.energy[cell]
        scratch[LEAKAGE * LANES + lane] = state.leakage[state.axial_part[cell]]
        scratch[MASS * LANES + lane] = grid.mass[slot + lane]
        scratch[_OLD_VOLUME * LANES + lane] = grid.volume[slot + lane]
    for k in range(6 * LANES):
        scratch[STRESS * LANES + k] = 0.0
    if min_burn < 1.0:
        for lane in range(LANES):
            cell = np.uint64(grid.cells[block, lane])
            by_time = (time - state.ignition_time[cell]) * state.burn_rate[cell]
            scratch[BURN * LANES + lane] = max(scratch[BURN * LANES + lane], min(by_time, 1.0))
            scratch[_BY_COMPRESSION * LANES + lane] = by_compression if time >= state.compression_from[cell] else 0.0
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
        scratch[VOLUME * LANES + lane] = grid.volume[slot + lane]
        for k in range(9):
            scratch[(RATE + k) * LANES + lane] = 0.0
        for k in range(4):
            store_vector(_ZERO, scratch, HOURGLASS + 3 * k, lane)
    return count


@block_kernel
def _empty(block: int, released: np.ndarray, scratch: np.ndarray) -> None:
    """Take viscosity, hourglass control and their share of the stable step from released cells."""
    for lane in range(LANES):
        if released[block * LANES + lane] != WHOLE:
            scratch[VISCOUS * LANES + lane] = scratch[DAMPING * LANES + lane] = 0.0
            scratch[STABLE * LANES + lane] = np.inf


@block_kernel
def burn_by_compression(material: np.ndarray, scratch: np.ndarray) -> None:
    """Burn the cells as far as their compression burns them."""
    widest_vectors()
    for lane in range(LANES):
        relative = scratch[VOLUME * LANES + lane] * material[0] / scratch[MASS * LANES + lane]
        compressed = scratch[_BY_COMPRESSION * LANES + lane] * (1.0 - relative)
        scratch[BURN * LANES + lane] = max(scratch[BURN * LANES + lane], min(compressed, 1.0))


@lane_function
def _mix(
    relative: float, products: float, stiffness: float, material: np.ndarray, scratch: np.ndarray, lane: int
) -> None:
    """Pressure and stiffness (Pa) of a cell at V/V0 from those of its products and of its unreacted part."""
    xi = scratch[BURN * LANES + lane]
    pressure, slope = _unreacted(relative, material)
    unreacted_stiffness = slope / relative + 4.0 / 3.0 * material[2]
    scratch[PRESSURE * LANES + lane] = xi * products + (1.0 - xi) * pressure
    scratch[STIFFNESS * LANES + lane] = xi * stiffness + (1.0 - xi) * unreacted_stiffness


@lane_function
def _unreacted(relative: float, material: np.ndarray) -> tuple[float, float]:
    """Pressure of the unreacted explosive at V/V0 and its slope over rho/rho0 - 1 (Pa).

    On the Hugoniot of shocks of speed U = c0 + s u, with mu = rho/rho0 - 1: P = K mu (1 + mu) / (1 - (s - 1) mu)^2,
    beyond the limit, before its pole, on its tangent. Pressed explosive parts in tension at about its strength.
    """
    mu = 1.0 / relative - 1.0
    on_curve = min(max(mu, 0.0), material[19])
    inverse = 1.0 / (1.0 - (material[18] - 1.0) * on_curve)
    squared = material[1] * (inverse * inverse)
    slope = squared * inverse * (1.0 + (material[18] + 1.0) * on_curve)
    pressure = squared * (on_curve * (1.0 + on_curve)) + slope * (mu - on_curve)
    return max(pressure, -material[3]), slope


@block_kernel
def press_by_landau(material: np.ndarray, scratch: np.ndarray) -> None:
    """Pressure of the products on the isentrope of Landau and Stanyukovich, mixed with that of the unreacted part."""
    widest_vectors()
    p0, pk, inverse_knee = material[10], material[11], 1.0 / material[12]
    for lane in range(LANES):
        v = scratch[VOLUME * LANES + lane] * material[0] / scratch[MASS * LANES + lane]
        root = _inverse_cube_root(v * inverse_knee)
        squared = root * root
        inverse = 1.0 / v
        dense = v < material[12]
        p = p0 * (inverse * inverse * inverse) if dense else pk * (squared * squared)
        _mix(v, p, 3.0 * p if dense else 4.0 / 3.0 * p, material, scratch, lane)


@block_kernel
def press_by_jwl(material: np.ndarray, scratch: np.ndarray) -> None:
    """Pressure of Jones, Wilkins and Lee with its own internal energy, mixed with that of the unreacted part.

    dE = -P dV per initial volume, P the mean over the step of what the whole cell exerts (products and unreacted part);
    P is linear in E, so the implicit step is solved directly.
    """
    widest_vectors()
    a, b, r1, r2, omega = material[13], material[14], material[15], material[16], material[17]
    for lane in range(LANES):
        per_volume = material[0] / scratch[MASS * LANES + lane]
        v = scratch[VOLUME * LANES + lane] * per_volume
        xi = scratch[BURN * LANES + lane]
        change = v - scratch[_OLD_VOLUME * LANES + lane] * per_volume
        e1, e2 = a * np.exp(-r1 * v), b * np.exp(-r2 * v)
        cold = (1.0 - omega / (r1 * v)) * e1 + (1.0 - omega / (r2 * v)) * e2
        others = scratch[_OLD_PRESSURE * LANES + lane] + (1.0 - xi) * _unreacted(v, material)[0]
        rest = scratch[_CONTENT * LANES + lane] - 0.5 * others * change
        p = max((cold + omega * rest / v) / (1.0 + 0.5 * xi * omega * change / v), 0.0)
        e = rest - 0.5 * xi * p * change
        scratch[_CONTENT * LANES + lane] = e
        slope = e1 * (r1 * v - omega - omega / (r1 * v)) + e2 * (r2 * v - omega - omega / (r2 * v))
        # On the isentrope.
        _mix(v, p, max(slope + omega * (e / v + p), p), material, scratch, lane)


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
            scratch[(_STORED + k) * LANES + lane] = state.stress[cell, 0, k]
    for lane in range(LANES):
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = load_matrix(scratch, RATE, lane)
        mean = (xx + yy + zz) * (1.0 / 3.0)
        rate = ((xx - mean, xy, xz), (yx, yy - mean, yz), (zx, zy, zz - mean))
        old = load_symmetric(scratch, _STORED, lane)
        trial = elastic_trial(old, spin(rate, step), rate, step, 0.0, material[2])
        norm = np.sqrt(symmetric_square(trial))
        limit = (1.0 - scratch[BURN * LANES + lane]) * material[3]
        factor = limit / norm if norm > limit else 1.0
        txx, tyy, tzz = scaled(factor, (trial[0], trial[1], trial[2]))
        txy, tyz, tzx = scaled(factor, (trial[3], trial[4], trial[5]))
        store_symmetric((txx, tyy, tzz, txy, tyz, tzx), scratch, STRESS, lane)
        scratch[_HELD * LANES + lane] = 0.5 * (
            dot((txx + old[0], tyy + old[1], tzz + old[2]), (rate[0][0], rate[1][1], rate[2][2]))
            + dot((txy + old[3], tyz + old[4], tzx + old[5]), (xy + yx, yz + zy, zx + xz))
        )
    work = 0.0
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            state.stress[cell, 0, k] = scratch[(STRESS + k) * LANES + lane]
        work += quantise(scratch[_HELD * LANES + lane] * step * scratch[VOLUME * LANES + lane], grid.rounding)
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
        change = volume - scratch[_OLD_VOLUME * LANES + lane]
        # Mean of both ends of the step, as the forces work: at the front q rises and falls within a few steps.
        heating = -0.5 * (grid.viscous[slot + lane] + viscous) * change
        heat += quantise(heating, grid.rounding)
        mean_pressure = 0.5 * (scratch[_OLD_PRESSURE * LANES + lane] + pressure)
        work += quantise(scratch[LEAKAGE * LANES + lane] * mean_pressure * change, grid.rounding)
        hourglass += quantise(scratch[POWER * LANES + lane] * step, grid.rounding)
        grid.viscous[slot + lane] = viscous
        grid.stable[slot + lane] = stable
        grid.volume[slot + lane] = volume
        lower_limits(grid.cells[block, lane], stable, volume, share, limits)
        state.pressure[cell] = pressure
        state.burn_fraction[cell] = scratch[BURN * LANES + lane]
        # The shock's heat enters the products' energy a step late, but whole.
        state.energy[cell] = scratch[_CONTENT * LANES + lane] + heating * material[0] / scratch[MASS * LANES + lane]
    energy[1] += heat
    energy[2] += hourglass
    energy[3] += work
    energy[4] += heat
