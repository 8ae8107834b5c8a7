"""Kernel of casing and fuze with 2x2x2 points and mean dilatation (B-bar), for a block of cells.

The volumetric part of the velocity gradient is the cell's mean at every point (Hughes 1980), so the
kernel does not lock in plastic flow. A charge has no shear stiffness once it burns and its dilatation is the
mean one at every point, so for it this rule is the one-point rule, with the hourglass control it needs either way.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells.common import (
    FORCE,
    POSITION,
    VELOCITY,
    earlier,
    gather_velocities,
    lower_limits,
    viscosity_and_step,
)
from burst_fenicsx.kernels.cells.full_quadrature_rows import (
    COFACTOR,
    DETERMINANT,
    DILATATION,
    ELASTIC,
    FREQUENCY,
    GRADIENT,
    MIDDLE,
    PLACE,
    PLASTIC,
    POWER,
    SHEAR_STRAIN,
    SMALLEST,
    SOFTENING,
    SPEED,
    STABLE,
    STRENGTH,
    STRESS,
    SUM,
    TENSION,
    VISCOUS,
    VOLUME,
    VOLUME_STRAIN,
)
from burst_fenicsx.kernels.cells.full_quadrature_torn_metal import damp_hourglass, mark_torn_metal, release_metal
from burst_fenicsx.kernels.cells.hexahedron import (
    PER_CELL,
    Gradient,
    Modes,
    cell_gradient,
    cell_modes,
    load_gradient,
    squared_gradients,
    store_gradient,
    store_nodal_forces,
)
from burst_fenicsx.kernels.cells.solid import elastic_energy, elastic_trial, is_elastic, return_if_plastic, spin
from burst_fenicsx.kernels.cells.torn_metal import WHOLE
from burst_fenicsx.kernels.lanes import LANES, block_kernel, inlined_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import Grid, Nodes, SolidState
from burst_fenicsx.kernels.vectors.exact import quantise
from burst_fenicsx.kernels.vectors.nodal_values import add_nodal_forces, gather
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    add_outer,
    add_scaled,
    add_vector,
    apply,
    cross,
    dot,
    load_matrix,
    load_symmetric,
    load_vector,
    outer,
    scaled,
    store_matrix,
    store_symmetric,
    store_vector,
)
from burst_fenicsx.materials.tresca import softened_strength

__all__ = ["solid_block_full"]

_GAUSS = 1.0 / np.sqrt(3.0)


@inlined_kernel
def solid_block_full(
    block: int,
    step: float,
    share: float,
    nodes: Nodes,
    grid: Grid,
    state: SolidState,
    scratch: np.ndarray,
    energy: np.ndarray,
    limits: np.ndarray,
) -> None:
    """Advance one block of solid cells by `step` (s) at 2x2x2 points; arguments as for `solid.solid_block`."""
    cells = grid.cells[block]
    count = grid.filled[block]
    material = state.parameters[grid.material[block]]
    gather(cells, grid.dofmap, nodes.position, scratch[POSITION * LANES :])
    gather_velocities(block, nodes, grid, scratch[VELOCITY * LANES :])
    _move_cells(block, step, state, scratch)
    for point in range(8):
        # In the order of dolfinx's quadrature space, zeta fastest, so that its functions mean what they say.
        xi = _GAUSS if point & 4 else -_GAUSS
        eta = _GAUSS if point & 2 else -_GAUSS
        zeta = _GAUSS if point & 1 else -_GAUSS
        _load_point(cells, point, material, state, scratch)
        if _try_elastic(xi, eta, zeta, step, material, scratch) > 0:
            _return_plastic(material, scratch)
        _add_point(xi, eta, zeta, scratch)
        _store_point(block, count, point, grid, state, scratch)
    damp_hourglass(block, step, max(step, share * grid.longest), material, grid, scratch)
    _finish(block, share, nodes.rounding, material, grid, scratch)
    if mark_torn_metal(block, material, state, scratch) > 0:
        release_metal(block, grid, state, scratch)
    add_nodal_forces(count, cells, grid.dofmap, scratch[FORCE * LANES :], nodes.force)
    _accumulate(block, step, share, grid, scratch, energy, limits)


@lane_function
def _store_modes(modes: Modes, scratch: np.ndarray, row: int, lane: int) -> None:
    """Put an eighth of the modes in 21 rows."""
    a, b, f, c, e, d, g = modes
    store_vector(scaled(0.125, a), scratch, row, lane)
    store_vector(scaled(0.125, b), scratch, row + 3, lane)
    store_vector(scaled(0.125, f), scratch, row + 6, lane)
    store_vector(scaled(0.125, c), scratch, row + 9, lane)
    store_vector(scaled(0.125, e), scratch, row + 12, lane)
    store_vector(scaled(0.125, d), scratch, row + 15, lane)
    store_vector(scaled(0.125, g), scratch, row + 18, lane)


@lane_function
def _flux(velocity: Modes, gradient: Gradient) -> float:
    """Rate of the volume (m3/s) that belongs to a gradient."""
    a, b, f, c, e, d, _ = velocity
    p, q, s3, r, s5, s6 = gradient
    return dot(a, p) + dot(b, q) + dot(f, s3) + dot(c, r) + dot(e, s5) + dot(d, s6)


@block_kernel
def _move_cells(block: int, step: float, state: SolidState, scratch: np.ndarray) -> None:
    """Modes, mean dilatation on the mid-step configuration, and the shape after the step; sums are set to zero."""
    widest_vectors()
    back = -0.5 * step
    for lane in range(LANES):
        place, velocity = cell_modes(scratch, POSITION, lane), cell_modes(scratch, VELOCITY, lane)
        _store_modes(place, scratch, PLACE, lane)
        _store_modes(velocity, scratch, SPEED, lane)
        middle = earlier(place, velocity, back)
        gradient, volume = cell_gradient(middle)
        scratch[DILATATION * LANES + lane] = _flux(velocity, gradient) / volume
        gradient, volume = cell_gradient(place)
        store_gradient(gradient, scratch, GRADIENT, lane)
        _, largest = squared_gradients(gradient)
        scratch[FREQUENCY * LANES + lane] = np.sqrt(16.0 * largest) / volume
        scratch[VOLUME * LANES + lane] = scratch[SMALLEST * LANES + lane] = PER_CELL * volume
        scratch[TENSION * LANES + lane] = 0.0
        scratch[PLASTIC * LANES + lane] = 0.0
        scratch[STRENGTH * LANES + lane] = scratch[ELASTIC * LANES + lane] = 0.0
    for k in range(21 * LANES):
        scratch[SUM * LANES + k] = 0.0
    for lane in range(LANES):
        scratch[SOFTENING * LANES + lane] = state.softening_scale[block * LANES + lane]


@block_kernel
def _load_point(cells: np.ndarray, point: int, material: np.ndarray, state: SolidState, scratch: np.ndarray) -> None:
    """Gather the cell state of a point into lanes, with the strength that it has."""
    for lane in range(LANES):
        cell = np.uint64(cells[lane])
        for k in range(6):
            scratch[(STRESS + k) * LANES + lane] = state.stress[cell, point, k]
        scratch[SHEAR_STRAIN * LANES + lane] = state.shear_strain[cell, point]
        scratch[VOLUME_STRAIN * LANES + lane] = state.volume_strain[cell, point]
        tau, _ = _strengths(material, scratch, lane)
        scratch[STRENGTH * LANES + lane] = max(scratch[STRENGTH * LANES + lane], tau)
        scratch[ELASTIC * LANES + lane] += elastic_energy(load_symmetric(scratch, STRESS, lane), material)


@block_kernel
def _store_point(block: int, count: int, point: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Write the cell state of a point back, but of cells that have been released: their shape may have made it NaN."""
    for lane in range(count):
        if state.released[block * LANES + lane] != WHOLE:
            continue
        cell = np.uint64(grid.cells[block, lane])
        for k in range(6):
            state.stress[cell, point, k] = scratch[(STRESS + k) * LANES + lane]
        shear_strain, volume_strain = scratch[SHEAR_STRAIN * LANES + lane], scratch[VOLUME_STRAIN * LANES + lane]
        if shear_strain + volume_strain < np.inf:  # not of a cell without volume, which is about to be released
            state.shear_strain[cell, point], state.volume_strain[cell, point] = shear_strain, volume_strain


@lane_function
def _tangents(xi: float, eta: float, zeta: float, scratch: np.ndarray, row: int, lane: int) -> Matrix:
    """Derivatives of a field by xi, eta and zeta at one point, from an eighth of its modes."""
    a, b, f = load_vector(scratch, row, lane), load_vector(scratch, row + 3, lane), load_vector(scratch, row + 6, lane)
    c, e = load_vector(scratch, row + 9, lane), load_vector(scratch, row + 12, lane)
    d, g = load_vector(scratch, row + 15, lane), load_vector(scratch, row + 18, lane)
    return (
        add_scaled(add_scaled(a, eta, f), zeta, add_scaled(e, eta, g)),
        add_scaled(add_scaled(b, xi, f), zeta, add_scaled(d, xi, g)),
        add_scaled(add_scaled(c, xi, e), eta, add_scaled(d, xi, g)),
    )


@lane_function
def _cofactors(tangents: Matrix) -> tuple[Matrix, float]:
    """Cofactors of the Jacobian, by reference coordinates, and its determinant: grad N = dN/dxi . cofactors / det."""
    u, v, w = tangents
    normal = cross(v, w)
    return (normal, cross(w, u), cross(u, v)), dot(u, normal)


@lane_function
def _strengths(material: np.ndarray, scratch: np.ndarray, lane: int) -> tuple[float, float]:
    """Shear and tensile strength (Pa) after the strains so far."""
    scale = scratch[SOFTENING * LANES + lane]
    tau = softened_strength(material[2], scratch[SHEAR_STRAIN * LANES + lane], material[4] * scale)
    return tau, softened_strength(material[3], scratch[VOLUME_STRAIN * LANES + lane], material[5] * scale)


@block_kernel
def _try_elastic(xi: float, eta: float, zeta: float, step: float, material: np.ndarray, scratch: np.ndarray) -> int:
    """Add the elastic increment at a point; count the cells that may be plastic there.

    The dilatation of the velocity gradient is replaced by the cell's mean one (B-bar).
    """
    widest_vectors()
    shear = 0.5 * material[0] / (1.0 + material[1])
    lame = 2.0 * shear * material[1] / (1.0 - 2.0 * material[1])
    back = -0.5 * step
    plastic = 0
    for lane in range(LANES):
        after, speed = _tangents(xi, eta, zeta, scratch, PLACE, lane), _tangents(xi, eta, zeta, scratch, SPEED, lane)
        middle = (
            add_scaled(after[0], back, speed[0]),
            add_scaled(after[1], back, speed[1]),
            add_scaled(after[2], back, speed[2]),
        )
        cofactor, determinant = _cofactors(middle)
        whole = add_outer(add_outer(outer(speed[0], cofactor[0]), speed[1], cofactor[1]), speed[2], cofactor[2])
        scratch[MIDDLE * LANES + lane] = determinant
        inverse = 1.0 / determinant
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = (
            scaled(inverse, whole[0]),
            scaled(inverse, whole[1]),
            scaled(inverse, whole[2]),
        )
        more = (scratch[DILATATION * LANES + lane] - (xx + yy + zz)) * (1.0 / 3.0)
        rate = ((xx + more, xy, xz), (yx, yy + more, yz), (zx, zy, zz + more))
        stress = elastic_trial(load_symmetric(scratch, STRESS, lane), spin(rate, step), rate, step, lame, shear)
        store_symmetric(stress, scratch, STRESS, lane)
        tau, sigma = _strengths(material, scratch, lane)
        plastic += 0 if is_elastic(stress, tau, sigma) else 1
        cofactor, determinant = _cofactors(after)
        store_matrix(cofactor, scratch, COFACTOR, lane)
        scratch[DETERMINANT * LANES + lane] = determinant
    return plastic


@block_kernel
def _return_plastic(material: np.ndarray, scratch: np.ndarray) -> None:
    """Return the stresses at a point; those within the strengths stay as they are."""
    widest_vectors()
    for lane in range(LANES):
        tau, sigma = _strengths(material, scratch, lane)
        stress, shear_strain, volume_strain, dissipation = return_if_plastic(
            load_symmetric(scratch, STRESS, lane), tau, sigma, material[0], material[1]
        )
        store_symmetric(stress, scratch, STRESS, lane)
        scratch[SHEAR_STRAIN * LANES + lane] += shear_strain
        scratch[VOLUME_STRAIN * LANES + lane] += volume_strain
        scratch[PLASTIC * LANES + lane] += dissipation * scratch[MIDDLE * LANES + lane]


@block_kernel
def _add_point(xi: float, eta: float, zeta: float, scratch: np.ndarray) -> None:
    """Add a point's deviatoric force to the modes of the nodal forces: -s . cofactor . dN/dxi, of weight one.

    dN_a/dxi = xi_a (1 + eta_a eta) (1 + zeta_a zeta) / 8, so a traction on xi enters the modes xi, xi eta,
    xi zeta and xi eta zeta. The hydrostatic part is summed up, to act with the mean gradient.
    """
    widest_vectors()
    for lane in range(LANES):
        xx, yy, zz, xy, yz, zx = load_symmetric(scratch, STRESS, lane)
        mean = (xx + yy + zz) * (1.0 / 3.0)
        push = ((mean - xx, -xy, -zx), (-xy, mean - yy, -yz), (-zx, -yz, mean - zz))
        cofactor = load_matrix(scratch, COFACTOR, lane)
        t, u, v = apply(push, cofactor[0]), apply(push, cofactor[1]), apply(push, cofactor[2])
        add_vector(t, scratch, SUM, lane)
        add_vector(u, scratch, SUM + 3, lane)
        add_vector(add_scaled(scaled(eta, t), xi, u), scratch, SUM + 6, lane)
        add_vector(v, scratch, SUM + 9, lane)
        add_vector(add_scaled(scaled(zeta, t), xi, v), scratch, SUM + 12, lane)
        add_vector(add_scaled(scaled(zeta, u), eta, v), scratch, SUM + 15, lane)
        add_vector(add_scaled(add_scaled(scaled(eta * zeta, t), xi * zeta, u), xi * eta, v), scratch, SUM + 18, lane)
        determinant = scratch[DETERMINANT * LANES + lane]
        scratch[TENSION * LANES + lane] += mean * determinant
        scratch[SMALLEST * LANES + lane] = min(scratch[SMALLEST * LANES + lane], 8.0 * determinant)


@block_kernel
def _finish(block: int, share: float, rounding: float, material: np.ndarray, grid: Grid, scratch: np.ndarray) -> None:
    """Viscosity and stable step; nodal forces of the points' sum and of the pressure, which is the mean one."""
    widest_vectors()
    shear = 0.5 * material[0] / (1.0 + material[1])
    lame = 2.0 * shear * material[1] / (1.0 - 2.0 * material[1])
    for lane in range(LANES):
        volume = scratch[VOLUME * LANES + lane]
        density = grid.mass[block * LANES + lane] / volume
        sound = np.sqrt((lame + 2.0 * shear) / density)
        viscous, stable = viscosity_and_step(
            scratch[DILATATION * LANES + lane],
            1.0 / scratch[FREQUENCY * LANES + lane],
            density,
            sound,
            sound,
            material[6],
            material[7],
        )
        scratch[VISCOUS * LANES + lane] = viscous
        scratch[STABLE * LANES + lane] = stable
        pressure = PER_CELL * (viscous - scratch[TENSION * LANES + lane] / volume)
        p, q, s3, r, s5, s6 = load_gradient(scratch, GRADIENT, lane)
        modes = (
            add_scaled(scaled(0.125, load_vector(scratch, SUM, lane)), pressure, p),
            add_scaled(scaled(0.125, load_vector(scratch, SUM + 3, lane)), pressure, q),
            add_scaled(scaled(0.125, load_vector(scratch, SUM + 6, lane)), pressure, s3),
            add_scaled(scaled(0.125, load_vector(scratch, SUM + 9, lane)), pressure, r),
            add_scaled(scaled(0.125, load_vector(scratch, SUM + 12, lane)), pressure, s5),
            add_scaled(scaled(0.125, load_vector(scratch, SUM + 15, lane)), pressure, s6),
            scaled(0.125, load_vector(scratch, SUM + 18, lane)),
        )
        store_nodal_forces(modes, share, rounding, scratch, FORCE, lane)


@block_kernel
def _accumulate(
    block: int, step: float, share: float, grid: Grid, scratch: np.ndarray, energy: np.ndarray, limits: np.ndarray
) -> None:
    """Add up the work of the step and find the limits."""
    slot = block * LANES
    plastic = viscous_work = hourglass = 0.0
    for lane in range(grid.filled[block]):
        volume, viscous = scratch[VOLUME * LANES + lane], scratch[VISCOUS * LANES + lane]
        smallest, stable = scratch[SMALLEST * LANES + lane], scratch[STABLE * LANES + lane]
        plastic += quantise(scratch[PLASTIC * LANES + lane], grid.rounding)
        # Mean of both ends of the step, as the forces work: at a front q changes within it.
        work = 0.5 * (grid.viscous[slot + lane] + viscous) * (volume - grid.volume[slot + lane])
        viscous_work -= quantise(work, grid.rounding)
        hourglass += quantise(scratch[POWER * LANES + lane] * step, grid.rounding)
        grid.viscous[slot + lane] = viscous
        grid.stable[slot + lane] = stable
        grid.volume[slot + lane] = volume
        lower_limits(grid.cells[block, lane], stable, smallest, share, limits)
    energy[0] += plastic
    energy[1] += viscous_work
    energy[2] += hourglass
