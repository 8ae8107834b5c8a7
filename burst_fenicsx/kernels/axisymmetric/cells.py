"""Blocks of quadrilaterals: casing and fuze, and the charge, one step each.

What a cell remembers, its stress, strength, products and burn are the hexahedra's (`kernels.cells`); motion, hourglass
control and nodal forces are the quadrilateral's. The coefficients of the hourglass control are chosen so that a
hourglass mode decays and oscillates as in a cube of the same size.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.axisymmetric.quadrilateral import (
    AREA,
    GAMMA_SQUARE,
    Rings,
    add_forces_to_nodes,
    gather_nodes,
    move_quadrilaterals,
    store_forces,
)
from burst_fenicsx.kernels.axisymmetric.release import (
    drop_forces,
    empty_charge,
    hold_released,
    mark_crushed_products,
    mark_torn_metal,
    release_metal,
)
from burst_fenicsx.kernels.cells import charge as charge_parts
from burst_fenicsx.kernels.cells import charge_pressure
from burst_fenicsx.kernels.cells import solid as solid_parts
from burst_fenicsx.kernels.cells.common import (
    COEFFICIENT_LIMIT,
    DAMPING,
    FREQUENCY,
    HOURGLASS,
    MASS,
    MOST_DAMPED,
    POWER,
    RATE,
    STABLE,
    VISCOUS,
    VOLUME,
    trace_of_rate,
    viscosity_and_step,
)
from burst_fenicsx.kernels.lanes import LANES, block_kernel, widest_vectors
from burst_fenicsx.kernels.state import ChargeState, Grid, Nodes, SolidState
from burst_fenicsx.kernels.vectors.tensors import (
    apply,
    dot,
    load_matrix,
    load_symmetric,
    load_vector,
    scaled,
    store_symmetric,
    store_vector,
)

__all__ = ["charge_ring_block", "solid_ring_block"]

_LANDAU = 0.0  # value of the charge's parameter `model`


@block_kernel
def solid_ring_block(
    block: int,
    step: float,
    share: float,
    nodes: Nodes,
    grid: Grid,
    state: SolidState,
    rings: Rings,
    scratch: np.ndarray,
    energy: np.ndarray,
    limits: np.ndarray,
) -> None:
    """Advance one block of casing or fuze by `step` (s) and add its nodal forces times `share`.

    `rings` is what rings have besides; the other arguments as for `kernels.cells.solid.solid_block`.
    """
    cells, material = grid.cells[block], state.parameters[grid.material[block]]
    gather_nodes(cells, grid.dofmap, grid.level[block], nodes, rings.kept[block], scratch)
    solid_parts.load_state(block, grid, state, scratch)
    move_quadrilaterals(step, rings.plane, scratch)
    released = mark_torn_metal(material, scratch) > 0
    if released:
        hold_released(block, grid, scratch, rings)
    if _try_elastic(step, material, scratch) > 0:
        solid_parts.return_plastic(material, scratch)
    _stiffen_solid(step, max(step, share * grid.longest), material, scratch)
    if released:
        release_metal(material, scratch)
    _resist_solid(share, scratch)
    if released:
        drop_forces(scratch)
    add_forces_to_nodes(grid.filled[block], cells, grid.dofmap, scratch, nodes.force)
    solid_parts.store_state(block, grid, state, scratch)
    solid_parts.add_work(block, step, share, grid, scratch, energy, limits)


@block_kernel
def _try_elastic(step: float, material: np.ndarray, scratch: np.ndarray) -> int:
    """Rotate what is stored and add the elastic increment; count the cells that may be plastic."""
    widest_vectors()
    shear, lame = solid_parts.moduli(material)
    plastic = 0
    for lane in range(LANES):
        rate = load_matrix(scratch, RATE, lane)
        rotation = solid_parts.spin(rate, step)
        stress = load_symmetric(scratch, solid_parts.STRESS, lane)
        stress = solid_parts.elastic_trial(stress, rotation, rate, step, lame, shear)
        store_symmetric(stress, scratch, solid_parts.STRESS, lane)
        stored = apply(rotation, load_vector(scratch, solid_parts.STORED, lane))
        store_vector(stored, scratch, solid_parts.STORED, lane)
        tau, sigma = solid_parts.strengths(material, scratch, lane)
        plastic += 0 if solid_parts.is_elastic(stress, tau, sigma) else 1
        scratch[solid_parts.DISSIPATION * LANES + lane] = 0.0
    return plastic


@block_kernel
def _stiffen_solid(step: float, next_dt: float, material: np.ndarray, scratch: np.ndarray) -> None:
    """Artificial viscosity, stable steps and hourglass coefficients, limited for the next step `next_dt` (s)."""
    widest_vectors()
    shear, lame = solid_parts.moduli(material)
    stiff = lame + 2.0 * shear
    # Without shear strength only the bulk modulus answers, and the step may be longer by a quarter.
    softened = np.sqrt((lame + 2.0 / 3.0 * shear) / stiff)
    per_step = 1.0 / next_dt if next_dt > 0.0 else np.inf
    for lane in range(LANES):
        volume, frequency = scratch[VOLUME * LANES + lane], scratch[FREQUENCY * LANES + lane]
        mass = scratch[MASS * LANES + lane]
        density = mass / volume
        sound = np.sqrt(stiff / density)
        tau, _ = solid_parts.strengths(material, scratch, lane)
        fastest = sound if tau > 0.0 else softened * sound
        viscous, stable = viscosity_and_step(
            trace_of_rate(scratch, lane), 1.0 / frequency, density, sound, fastest, material[6], material[7]
        )
        scratch[VISCOUS * LANES + lane], scratch[STABLE * LANES + lane] = viscous, stable
        scratch[DAMPING * LANES + lane] = material[8] * mass * sound * frequency
        scratch[solid_parts.SPRING * LANES + lane] = (
            material[9] / 9.0 * stiff * step * volume / scratch[AREA * LANES + lane]
        )
        scratch[COEFFICIENT_LIMIT * LANES + lane] = per_step / scratch[GAMMA_SQUARE * LANES + lane]


@block_kernel
def _resist_solid(share: float, scratch: np.ndarray) -> None:
    """Nodal forces of the stresses, the artificial viscosity and the hourglass control."""
    widest_vectors()
    for lane in range(LANES):
        resistance, power = solid_parts.resist_mode(0, scratch, lane)
        scratch[POWER * LANES + lane] = power
        viscous = scratch[VISCOUS * LANES + lane]
        xx, yy, zz, xy, yz, zx = load_symmetric(scratch, solid_parts.STRESS, lane)
        store_forces((xx - viscous, yy - viscous, zz - viscous, xy, yz, zx), resistance, share, scratch, lane)


@block_kernel
def charge_ring_block(
    block: int,
    step: float,
    time: float,
    share: float,
    nodes: Nodes,
    grid: Grid,
    state: ChargeState,
    rings: Rings,
    scratch: np.ndarray,
    energy: np.ndarray,
    limits: np.ndarray,
) -> None:
    """Advance one block of charge by `step` to `time` (s) and add its nodal forces times `share`.

    `rings` is what rings have besides; the other arguments as for `kernels.cells.charge.charge_block`.
    """
    cells, material = grid.cells[block], state.parameters[grid.material[block]]
    gather_nodes(cells, grid.dofmap, grid.level[block], nodes, rings.kept[block], scratch)
    min_burn = charge_parts.load_state(block, time, material[8], grid, state, scratch)
    move_quadrilaterals(step, rings.plane, scratch)
    released = mark_crushed_products(scratch) > 0
    if released:
        hold_released(block, grid, scratch, rings)
    if min_burn < 1.0:
        charge_pressure.burn_by_compression(material, scratch)
    if material[9] == _LANDAU:
        charge_pressure.press_by_landau(material, scratch)
    else:
        charge_pressure.press_by_jwl(material, scratch)
    # The step in which a cell burns out still takes its deviator to zero.
    if min_burn < 1.0:
        charge_parts.hold_by_strength(block, step, material, grid, state, scratch, energy)
    _stiffen_charge(max(step, share * grid.longest), material, scratch)
    if released:
        empty_charge(scratch)
    _resist_charge(share, scratch)
    if released:
        drop_forces(scratch)
    add_forces_to_nodes(grid.filled[block], cells, grid.dofmap, scratch, nodes.force)
    charge_parts.add_work(block, step, share, material, grid, state, scratch, energy, limits)


@block_kernel
def _stiffen_charge(next_dt: float, material: np.ndarray, scratch: np.ndarray) -> None:
    """Artificial viscosity, stable steps and hourglass coefficient, limited for the next step `next_dt` (s)."""
    widest_vectors()
    # While a cell may still be initiated, the step allows for the products' sound speed at the front, 3/4 D.
    front_speed = 0.75 * material[7]
    per_step = 1.0 / next_dt if next_dt > 0.0 else np.inf
    for lane in range(LANES):
        frequency, mass = scratch[FREQUENCY * LANES + lane], scratch[MASS * LANES + lane]
        density = mass / scratch[VOLUME * LANES + lane]
        sound = np.sqrt(scratch[charge_pressure.STIFFNESS * LANES + lane] / density)
        fastest = max(sound, front_speed) if scratch[charge_pressure.BURN * LANES + lane] < 1.0 else sound
        viscous, stable = viscosity_and_step(
            trace_of_rate(scratch, lane), 1.0 / frequency, density, sound, fastest, material[4], material[5]
        )
        scratch[VISCOUS * LANES + lane], scratch[STABLE * LANES + lane] = viscous, stable
        coefficient_limit = MOST_DAMPED * per_step / scratch[GAMMA_SQUARE * LANES + lane]
        scratch[DAMPING * LANES + lane] = min(material[6] * mass * sound * frequency, coefficient_limit)


@block_kernel
def _resist_charge(share: float, scratch: np.ndarray) -> None:
    """Nodal forces of pressure, strength, artificial viscosity and hourglass control."""
    widest_vectors()
    for lane in range(LANES):
        rate, damping = load_vector(scratch, HOURGLASS, lane), scratch[DAMPING * LANES + lane]
        scratch[POWER * LANES + lane] = damping * dot(rate, rate)
        pressure = scratch[charge_pressure.LEAKAGE * LANES + lane] * scratch[charge_pressure.PRESSURE * LANES + lane]
        pressure += scratch[VISCOUS * LANES + lane]
        xx, yy, zz, xy, yz, zx = load_symmetric(scratch, charge_pressure.STRESS, lane)
        stress = (xx - pressure, yy - pressure, zz - pressure, xy, yz, zx)
        store_forces(stress, scaled(damping, rate), share, scratch, lane)
