"""Kernel of casing and fuze with 2x2x2 points and mean dilatation (B-bar), for a block of cells.

The volumetric part of the velocity gradient is the cell's mean at every point (Hughes 1980), so the
kernel does not lock in plastic flow. A charge has no shear stiffness once it burns and its dilatation is the
mean one at every point, so for it this rule is the one-point rule, with the hourglass control it needs either way.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.common import step_and_viscosity
from burst_fenicsx.kernels.hexahedron import (
    add_nodal_forces,
    gather_modes,
    largest_gradient,
    mean_gradient,
    mid_step_modes,
    velocity_gradient,
)
from burst_fenicsx.kernels.lanes import LANES, kernel
from burst_fenicsx.kernels.solid import elastic_trial, plastic_correction, spin
from burst_fenicsx.kernels.state import Grid, Nodes, SolidState

__all__ = ["solid_block_full"]

_GAUSS = 1.0 / np.sqrt(3.0)


@kernel
def _jacobian(modes: np.ndarray, xi: float, eta: float, zeta: float, jacobian: np.ndarray) -> None:
    """Derivative of the field by the reference coordinates at one point; rows 3 i + k, k = xi, eta, zeta."""
    for i in range(3):
        for lane in range(LANES):
            a = modes[(3 + i) * LANES + lane]
            b = modes[(6 + i) * LANES + lane]
            f = modes[(9 + i) * LANES + lane]
            c = modes[(12 + i) * LANES + lane]
            e = modes[(15 + i) * LANES + lane]
            d = modes[(18 + i) * LANES + lane]
            g = modes[(21 + i) * LANES + lane]
            jacobian[(3 * i) * LANES + lane] = 0.125 * (a + eta * f + zeta * e + eta * zeta * g)
            jacobian[(3 * i + 1) * LANES + lane] = 0.125 * (b + xi * f + zeta * d + xi * zeta * g)
            jacobian[(3 * i + 2) * LANES + lane] = 0.125 * (c + xi * e + eta * d + xi * eta * g)


@kernel
def _cofactors(jacobian: np.ndarray, cofactor: np.ndarray, determinant: np.ndarray) -> None:
    """Cofactors (rows 3 i + k) and determinant of the Jacobian; grad N = cofactor . dN/dxi / determinant."""
    for lane in range(LANES):
        j00, j01, j02 = jacobian[lane], jacobian[LANES + lane], jacobian[2 * LANES + lane]
        j10, j11, j12 = jacobian[3 * LANES + lane], jacobian[4 * LANES + lane], jacobian[5 * LANES + lane]
        j20, j21, j22 = jacobian[6 * LANES + lane], jacobian[7 * LANES + lane], jacobian[8 * LANES + lane]
        c00, c01, c02 = j11 * j22 - j12 * j21, j12 * j20 - j10 * j22, j10 * j21 - j11 * j20
        cofactor[lane] = c00
        cofactor[LANES + lane] = c01
        cofactor[2 * LANES + lane] = c02
        cofactor[3 * LANES + lane] = j21 * j02 - j22 * j01
        cofactor[4 * LANES + lane] = j22 * j00 - j20 * j02
        cofactor[5 * LANES + lane] = j20 * j01 - j21 * j00
        cofactor[6 * LANES + lane] = j01 * j12 - j02 * j11
        cofactor[7 * LANES + lane] = j02 * j10 - j00 * j12
        cofactor[8 * LANES + lane] = j00 * j11 - j01 * j10
        determinant[lane] = j00 * c00 + j01 * c01 + j02 * c02


@kernel
def _point_rate(
    derivative: np.ndarray, cofactor: np.ndarray, determinant: np.ndarray, mean: np.ndarray, rate: np.ndarray
) -> None:
    """Velocity gradient at a point with its dilatation replaced by the cell's mean one (B-bar)."""
    for lane in range(LANES):
        inverse = 1.0 / determinant[lane]
        for i in range(3):
            for j in range(3):
                rate[(3 * i + j) * LANES + lane] = inverse * (
                    derivative[(3 * i) * LANES + lane] * cofactor[(3 * j) * LANES + lane]
                    + derivative[(3 * i + 1) * LANES + lane] * cofactor[(3 * j + 1) * LANES + lane]
                    + derivative[(3 * i + 2) * LANES + lane] * cofactor[(3 * j + 2) * LANES + lane]
                )
        own = rate[lane] + rate[4 * LANES + lane] + rate[8 * LANES + lane]
        wanted = mean[lane] + mean[4 * LANES + lane] + mean[8 * LANES + lane]
        for i in range(3):
            rate[4 * i * LANES + lane] += (wanted - own) / 3.0


@kernel
def _add_point_force(
    stress: np.ndarray, cofactor: np.ndarray, xi: float, eta: float, zeta: float, modes: np.ndarray
) -> None:
    """Add a point's deviatoric force to the modes of the nodal forces: -s . cofactor . dN/dxi, of weight one.

    dN_a/dxi = xi_a (1 + eta_a eta) (1 + zeta_a zeta) / 8, so a traction on xi enters the modes xi, xi eta,
    xi zeta and xi eta zeta.
    """
    for i in range(3):
        for lane in range(LANES):
            xx, yy, zz = stress[lane], stress[LANES + lane], stress[2 * LANES + lane]
            mean = (xx + yy + zz) / 3.0
            sx = (xx - mean) if i == 0 else (stress[3 * LANES + lane] if i == 1 else stress[5 * LANES + lane])
            sy = stress[3 * LANES + lane] if i == 0 else ((yy - mean) if i == 1 else stress[4 * LANES + lane])
            sz = stress[5 * LANES + lane] if i == 0 else (stress[4 * LANES + lane] if i == 1 else (zz - mean))
            tx = -0.125 * (sx * cofactor[lane] + sy * cofactor[3 * LANES + lane] + sz * cofactor[6 * LANES + lane])
            ty = -0.125 * (
                sx * cofactor[LANES + lane] + sy * cofactor[4 * LANES + lane] + sz * cofactor[7 * LANES + lane]
            )
            tz = -0.125 * (
                sx * cofactor[2 * LANES + lane] + sy * cofactor[5 * LANES + lane] + sz * cofactor[8 * LANES + lane]
            )
            modes[(3 + i) * LANES + lane] += tx
            modes[(6 + i) * LANES + lane] += ty
            modes[(9 + i) * LANES + lane] += eta * tx + xi * ty
            modes[(12 + i) * LANES + lane] += tz
            modes[(15 + i) * LANES + lane] += zeta * tx + xi * tz
            modes[(18 + i) * LANES + lane] += zeta * ty + eta * tz
            modes[(21 + i) * LANES + lane] += eta * zeta * tx + xi * zeta * ty + xi * eta * tz


@kernel
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
    slot = block * LANES
    mass = grid.mass[slot : slot + LANES]
    position = scratch[: 24 * LANES]
    velocity = scratch[24 * LANES : 48 * LANES]
    middle = scratch[48 * LANES : 72 * LANES]
    gradient = scratch[72 * LANES : 90 * LANES]
    mean_rate = scratch[90 * LANES : 99 * LANES]
    stress = scratch[99 * LANES : 105 * LANES]
    rate = scratch[105 * LANES : 114 * LANES]
    rotation = scratch[114 * LANES : 123 * LANES]
    volume = scratch[123 * LANES : 124 * LANES]
    length = scratch[124 * LANES : 125 * LANES]
    density = scratch[125 * LANES : 126 * LANES]
    sound = scratch[126 * LANES : 127 * LANES]
    viscous = scratch[127 * LANES : 128 * LANES]
    stable = scratch[128 * LANES : 129 * LANES]
    shear_strain = scratch[129 * LANES : 130 * LANES]
    volume_strain = scratch[130 * LANES : 131 * LANES]
    dissipation = scratch[131 * LANES : 132 * LANES]
    mean_pressure = scratch[132 * LANES : 133 * LANES]
    determinant = scratch[133 * LANES : 134 * LANES]
    smallest = scratch[134 * LANES : 135 * LANES]
    work = scratch[135 * LANES : 162 * LANES]
    jacobian = work[: 9 * LANES]
    cofactor = scratch[162 * LANES : 171 * LANES]
    derivative = scratch[171 * LANES : 180 * LANES]
    forces = scratch[180 * LANES : 204 * LANES]

    modulus, poisson = material[0], material[1]
    shear = 0.5 * modulus / (1.0 + poisson)
    lame = modulus * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))

    gather_modes(cells, grid.dofmap, nodes.position, position)
    gather_modes(cells, grid.dofmap, nodes.velocity, velocity)
    mid_step_modes(position, velocity, 0.5 * step, middle)
    mean_gradient(middle, gradient, volume)
    velocity_gradient(velocity, gradient, volume, mean_rate)
    mean_gradient(position, gradient, volume)
    largest_gradient(gradient, volume, length)
    for lane in range(LANES):
        density[lane] = mass[lane] / volume[lane]
        sound[lane] = np.sqrt((lame + 2.0 * shear) / density[lane])
        mean_pressure[lane] = 0.0
        smallest[lane] = volume[lane]
    step_and_viscosity(mean_rate, length, density, sound, sound, material[6], material[7], viscous, stable)

    for k in range(24 * LANES):
        forces[k] = 0.0
    for point in range(8):
        # In the order of dolfinx's quadrature space, zeta fastest, so that its functions mean what they say.
        xi = _GAUSS if point & 4 else -_GAUSS
        eta = _GAUSS if point & 2 else -_GAUSS
        zeta = _GAUSS if point & 1 else -_GAUSS
        _jacobian(middle, xi, eta, zeta, jacobian)
        _cofactors(jacobian, cofactor, determinant)
        _jacobian(velocity, xi, eta, zeta, derivative)
        _point_rate(derivative, cofactor, determinant, mean_rate, rate)
        for lane in range(LANES):
            cell = cells[lane]
            for k in range(6):
                stress[k * LANES + lane] = state.stress[cell, point, k]
            shear_strain[lane] = state.shear_strain[cell, point]
            volume_strain[lane] = state.volume_strain[cell, point]
        spin(rate, step, rotation)
        elastic_trial(stress, rotation, rate, step, lame, shear)
        plastic_correction(
            count,
            stress,
            shear_strain,
            volume_strain,
            state.softening_scale[slot : slot + LANES],
            material,
            work,
            dissipation,
        )
        for lane in range(count):
            cell = cells[lane]
            for k in range(6):
                state.stress[cell, point, k] = stress[k * LANES + lane]
            state.shear_strain[cell, point] = shear_strain[lane]
            state.volume_strain[cell, point] = volume_strain[lane]
            energy[0] += dissipation[lane] * determinant[lane]
        _jacobian(position, xi, eta, zeta, jacobian)
        _cofactors(jacobian, cofactor, determinant)
        _add_point_force(stress, cofactor, xi, eta, zeta, forces)
        for lane in range(LANES):
            trace = stress[lane] + stress[LANES + lane] + stress[2 * LANES + lane]
            mean_pressure[lane] -= trace / 3.0 * determinant[lane] / volume[lane]
            smallest[lane] = min(smallest[lane], 8.0 * determinant[lane])

    for i in range(3):
        for lane in range(LANES):
            pressure = mean_pressure[lane] + viscous[lane]
            forces[(3 + i) * LANES + lane] += pressure * gradient[i * LANES + lane]
            forces[(6 + i) * LANES + lane] += pressure * gradient[(3 + i) * LANES + lane]
            forces[(12 + i) * LANES + lane] += pressure * gradient[(6 + i) * LANES + lane]
            forces[(9 + i) * LANES + lane] += pressure * gradient[(9 + i) * LANES + lane]
            forces[(15 + i) * LANES + lane] += pressure * gradient[(12 + i) * LANES + lane]
            forces[(18 + i) * LANES + lane] += pressure * gradient[(15 + i) * LANES + lane]
    for lane in range(count):
        # Mean of both ends of the step, as the forces work: at a front q changes within it.
        mean_viscous = 0.5 * (grid.viscous[slot + lane] + viscous[lane])
        energy[1] -= mean_viscous * (volume[lane] - grid.volume[slot + lane])
        grid.viscous[slot + lane] = viscous[lane]
        grid.stable[slot + lane] = stable[lane]
        if stable[lane] < share * limits[0]:
            limits[0] = stable[lane] / share
            limits[1] = cells[lane]
        if not smallest[lane] >= limits[2]:
            # Not a number must not be overwritten by the next cell.
            limits[2] = smallest[lane] if smallest[lane] == smallest[lane] else -np.inf
            limits[3] = cells[lane]
        grid.volume[slot + lane] = volume[lane]
    add_nodal_forces(count, cells, grid.dofmap, forces, share, nodes.rounding, nodes.force)
