"""Kernel of the charge: burn fraction, products' pressure, unlit explosive, hourglass control, nodal forces."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.common import (
    MOST_DAMPED,
    force_modes,
    gradient_norms,
    hourglass_rates,
    hourglass_square,
    resist_hourglass,
    step_and_viscosity,
)
from burst_fenicsx.kernels.hexahedron import (
    add_nodal_forces,
    gather_modes,
    largest_gradient,
    mean_gradient,
    mid_step_modes,
    velocity_gradient,
)
from burst_fenicsx.kernels.lanes import LANES, kernel
from burst_fenicsx.kernels.solid import elastic_trial, spin
from burst_fenicsx.kernels.state import ChargeState, Grid, Nodes

__all__ = ["PARAMETERS", "charge_block"]

PARAMETERS = (
    "density",
    "unlit_bulk_modulus",
    "unlit_shear_modulus",
    "unlit_strength",
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
)
"""Columns of the table of explosives (SI). `model` is 0 for an isentrope of Landau and Stanyukovich (P0, Pk, Vk), 1 for
Jones-Wilkins-Lee (A to omega). `burn_by_compression` is 1/(1 - V_CJ/V0), or 0 for burning by time alone."""


@kernel
def _inverse_cube_root(x: float) -> np.float64:
    """x^(-1/3) by Newton's iteration from a guess made on the exponent; vectorises where a power does not."""
    bits = np.float64(x).view(np.int64)
    third = (bits >> 2) + (bits >> 4) + (bits >> 6) + (bits >> 8) + (bits >> 10) + (bits >> 12) + (bits >> 14)
    y = np.int64(6142909891733356544 - third).view(np.float64)
    for _ in range(5):
        y *= (4.0 - x * y * y * y) * (1.0 / 3.0)
    return y


@kernel
def _landau_pressure(relative: np.ndarray, parameters: np.ndarray, pressure: np.ndarray, stiffness: np.ndarray) -> None:
    """Pressure P (Pa) of the products at V/V0 and -V dP/dV (Pa), Landau-Stanyukovich."""
    p0, pk, vk = parameters[10], parameters[11], parameters[12]
    knee = pk * vk ** (4.0 / 3.0)
    for lane in range(LANES):
        v = relative[lane]
        root = _inverse_cube_root(v)
        squared = root * root
        dense = v < vk
        cubed = squared * root
        p = p0 * cubed * cubed * cubed if dense else knee * squared * squared
        pressure[lane] = p
        stiffness[lane] = 3.0 * p if dense else 4.0 / 3.0 * p


@kernel
def _jwl_pressure(
    relative: np.ndarray,
    old_relative: np.ndarray,
    burn: np.ndarray,
    unlit: np.ndarray,
    old_pressure: np.ndarray,
    parameters: np.ndarray,
    energy: np.ndarray,
    pressure: np.ndarray,
    stiffness: np.ndarray,
) -> None:
    """Pressure of Jones, Wilkins and Lee with its own internal energy, and -V dP/dV on the isentrope (Pa).

    dE = -P dV per initial volume, P the mean over the step of what the whole cell exerts (products and unlit part);
    P is linear in E, so the implicit step is solved directly. `energy` (J/m3) is updated in place.
    """
    a, b, r1, r2, omega = parameters[13], parameters[14], parameters[15], parameters[16], parameters[17]
    for lane in range(LANES):
        v = relative[lane]
        xi = burn[lane]
        change = v - old_relative[lane]
        e1, e2 = a * np.exp(-r1 * v), b * np.exp(-r2 * v)
        cold = (1.0 - omega / (r1 * v)) * e1 + (1.0 - omega / (r2 * v)) * e2
        rest = energy[lane] - 0.5 * (old_pressure[lane] + (1.0 - xi) * unlit[lane]) * change
        p = max((cold + omega * rest / v) / (1.0 + 0.5 * xi * omega * change / v), 0.0)
        e = rest - 0.5 * xi * p * change
        energy[lane] = e
        pressure[lane] = p
        slope = e1 * (r1 * v - omega - omega / (r1 * v)) + e2 * (r2 * v - omega - omega / (r2 * v))
        stiffness[lane] = max(slope + omega * (e / v + p), p)


@kernel
def _add_unlit_deviator(
    cells: np.ndarray,
    count: int,
    step: float,
    rate: np.ndarray,
    rotation: np.ndarray,
    burn: np.ndarray,
    volume: np.ndarray,
    shear: float,
    strength: float,
    stored: np.ndarray,
    stress: np.ndarray,
    deviator: np.ndarray,
    energy: np.ndarray,
) -> None:
    """Weak strength of the unlit charge: elastic, ideally plastic (von Mises in shear), fading as it burns.

    `stored` (cells, points, 6) holds the deviators (Pa); `stress` (6 LANES,) is added to. Its whole work is booked
    as plastic, since what is stored elastically is lost when the cell burns.
    """
    for lane in range(LANES):
        cell = cells[lane]
        mean = (rate[lane] + rate[4 * LANES + lane] + rate[8 * LANES + lane]) / 3.0
        rate[lane] -= mean
        rate[4 * LANES + lane] -= mean
        rate[8 * LANES + lane] -= mean
        for k in range(6):
            deviator[k * LANES + lane] = stored[cell, 0, k]
    spin(rate, step, rotation)
    elastic_trial(deviator, rotation, rate, step, 0.0, shear)
    for lane in range(count):
        xx, yy, zz = deviator[lane], deviator[LANES + lane], deviator[2 * LANES + lane]
        xy, yz, zx = deviator[3 * LANES + lane], deviator[4 * LANES + lane], deviator[5 * LANES + lane]
        norm = np.sqrt(0.5 * (xx * xx + yy * yy + zz * zz) + xy * xy + yz * yz + zx * zx)
        limit = (1.0 - burn[lane]) * strength
        factor = limit / norm if norm > limit else 1.0
        old = stored[cells[lane], 0]
        power = (
            (factor * xx + old[0]) * rate[lane]
            + (factor * yy + old[1]) * rate[4 * LANES + lane]
            + (factor * zz + old[2]) * rate[8 * LANES + lane]
            + (factor * xy + old[3]) * (rate[LANES + lane] + rate[3 * LANES + lane])
            + (factor * yz + old[4]) * (rate[5 * LANES + lane] + rate[7 * LANES + lane])
            + (factor * zx + old[5]) * (rate[6 * LANES + lane] + rate[2 * LANES + lane])
        )
        energy[0] += 0.5 * power * step * volume[lane]
        for k in range(6):
            value = factor * deviator[k * LANES + lane]
            stored[cells[lane], 0, k] = value
            stress[k * LANES + lane] += value


@kernel
def charge_block(
    block: int,
    step: float,
    time: float,
    share: float,
    nodes: Nodes,
    grid: Grid,
    state: ChargeState,
    scratch: np.ndarray,
    energy: np.ndarray,
    limits: np.ndarray,
) -> None:
    """Advance one block of charge cells by `step` to `time` (s) and add its nodal forces times `share`.

    `share`, `energy` and `limits` as for `solid_block`; entry 3 of `energy` is the work of the charge's pressure, entry 4 the
    part of it that the charge's own artificial viscosity turns to heat.
    """
    cells = grid.cells[block]
    count = grid.filled[block]
    material = state.parameters[grid.material[block]]
    slot = block * LANES
    mass = grid.mass[slot : slot + LANES]
    position = scratch[: 24 * LANES]
    velocity = scratch[24 * LANES : 48 * LANES]
    middle = scratch[48 * LANES : 72 * LANES]
    gradient = scratch[72 * LANES : 90 * LANES]
    rate = scratch[90 * LANES : 99 * LANES]
    stress = scratch[99 * LANES : 105 * LANES]
    amplitude = scratch[105 * LANES : 117 * LANES]
    rotation = scratch[117 * LANES : 126 * LANES]
    volume = scratch[126 * LANES : 127 * LANES]
    length = scratch[127 * LANES : 128 * LANES]
    density = scratch[128 * LANES : 129 * LANES]
    sound = scratch[129 * LANES : 130 * LANES]
    viscous = scratch[130 * LANES : 131 * LANES]
    stable = scratch[131 * LANES : 132 * LANES]
    power = scratch[132 * LANES : 133 * LANES]
    relative = scratch[133 * LANES : 134 * LANES]
    old_relative = scratch[134 * LANES : 135 * LANES]
    burn = scratch[135 * LANES : 136 * LANES]
    pressure = scratch[136 * LANES : 137 * LANES]
    stiffness = scratch[137 * LANES : 138 * LANES]
    old_pressure = scratch[138 * LANES : 139 * LANES]
    content = scratch[139 * LANES : 140 * LANES]
    coefficient = scratch[140 * LANES : 141 * LANES]
    fastest = scratch[141 * LANES : 142 * LANES]
    total = scratch[142 * LANES : 143 * LANES]
    unlit = scratch[143 * LANES : 144 * LANES]
    leakage = scratch[144 * LANES : 145 * LANES]
    deviator = scratch[145 * LANES : 151 * LANES]
    slope = scratch[151 * LANES : 154 * LANES]

    density0, unlit_bulk, unlit_shear, unlit_strength = material[0], material[1], material[2], material[3]
    by_compression = material[8]
    # While a cell may still light, the step allows for the products' sound speed at the front, 3/4 D.
    front_speed = 0.75 * material[7]

    gather_modes(cells, grid.dofmap, nodes.position, position)
    gather_modes(cells, grid.dofmap, nodes.velocity, velocity)
    mid_step_modes(position, velocity, 0.5 * step, middle)
    mean_gradient(middle, gradient, volume)
    velocity_gradient(velocity, gradient, volume, rate)
    hourglass_rates(velocity, middle, rate, amplitude)
    mean_gradient(position, gradient, volume)
    largest_gradient(gradient, volume, length)

    least_burn = 1.0
    for lane in range(LANES):
        cell = cells[lane]
        relative[lane] = volume[lane] * density0 / mass[lane]
        old_relative[lane] = grid.volume[slot + lane] * density0 / mass[lane]
        density[lane] = mass[lane] / volume[lane]
        old_burn = state.burn_fraction[cell]
        by_time = (time - state.ignition_time[cell]) * state.burn_rate[cell]
        compressed = by_compression * (1.0 - relative[lane]) if time >= state.compression_from[cell] else 0.0
        burn[lane] = min(max(old_burn, by_time, compressed), 1.0)
        # The step in which a cell burns out still takes its deviator to zero.
        least_burn = min(least_burn, old_burn)
        # Pressed explosive parts in tension at about its strength.
        unlit[lane] = max(unlit_bulk * (1.0 / relative[lane] - 1.0), -unlit_strength)
        old_pressure[lane] = state.pressure[cell]
        content[lane] = state.energy[cell]
        leakage[lane] = state.leakage[state.axial_part[cell]]

    if material[9] == 0.0:
        _landau_pressure(relative, material, pressure, stiffness)
    else:
        _jwl_pressure(relative, old_relative, burn, unlit, old_pressure, material, content, pressure, stiffness)

    for lane in range(LANES):
        xi = burn[lane]
        pressure[lane] = xi * pressure[lane] + (1.0 - xi) * unlit[lane]
        total[lane] = leakage[lane] * pressure[lane]
        unlit_stiffness = unlit_bulk / relative[lane] + 4.0 / 3.0 * unlit_shear
        stiffness[lane] = xi * stiffness[lane] + (1.0 - xi) * unlit_stiffness
        sound[lane] = np.sqrt(stiffness[lane] / density[lane])
        fastest[lane] = max(sound[lane], front_speed) if xi < 1.0 else sound[lane]
    for k in range(6):
        for lane in range(LANES):
            stress[k * LANES + lane] = -total[lane] if k < 3 else 0.0

    step_and_viscosity(rate, length, density, sound, fastest, material[4], material[5], viscous, stable)
    for lane in range(count):
        cell = cells[lane]
        change = volume[lane] - grid.volume[slot + lane]
        # Mean of both ends of the step, as the forces work: at the front q rises and falls within a few steps.
        heating = -0.5 * (grid.viscous[slot + lane] + viscous[lane]) * change
        grid.viscous[slot + lane] = viscous[lane]
        energy[1] += heating
        energy[4] += heating
        energy[3] += 0.5 * leakage[lane] * (old_pressure[lane] + pressure[lane]) * change
        grid.stable[slot + lane] = stable[lane]
        if stable[lane] < share * limits[0]:
            limits[0] = stable[lane] / share
            limits[1] = cell
        if not volume[lane] >= limits[2]:
            # Not a number must not be overwritten by the next cell.
            limits[2] = volume[lane] if volume[lane] == volume[lane] else -np.inf
            limits[3] = cell
        grid.volume[slot + lane] = volume[lane]
        state.pressure[cell] = pressure[lane]
        state.burn_fraction[cell] = burn[lane]
        # The shock's heat enters the products' energy a step late, but whole.
        state.energy[cell] = content[lane] + heating * density0 / mass[lane]
    if least_burn < 1.0:
        _add_unlit_deviator(
            cells,
            count,
            step,
            rate,
            rotation,
            burn,
            volume,
            unlit_shear,
            unlit_strength,
            state.stress,
            stress,
            deviator,
            energy,
        )

    gradient_norms(gradient, volume, slope)
    bounded = max(step, share * grid.longest)
    for lane in range(LANES):
        square = 8.0
        for a in range(4):
            square = max(square, hourglass_square(lane, 3 if a == 0 else a + 4, position, slope))
        bearable = mass[lane] / (8.0 * square * bounded) if bounded > 0.0 else np.inf
        usual = 0.25 * material[6] * density[lane] * sound[lane] * volume[lane] / length[lane]
        coefficient[lane] = min(usual, MOST_DAMPED * bearable)
    resist_hourglass(coefficient, amplitude, power)
    for lane in range(count):
        energy[2] += power[lane] * step
    force_modes(stress, viscous, amplitude, position, gradient, volume, velocity)
    add_nodal_forces(count, cells, grid.dofmap, velocity, share, nodes.rounding, nodes.force)
