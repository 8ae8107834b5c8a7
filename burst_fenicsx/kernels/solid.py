"""One-point kernel of casing and fuze: objective rate, Tresca return, hourglass control, nodal forces."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.common import (
    MOST_DAMPED,
    force_modes,
    gradient_norms,
    hourglass_rates,
    hourglass_square,
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
from burst_fenicsx.kernels.state import Grid, Nodes, SolidState
from burst_fenicsx.materials.tresca import return_stresses, softened_strength

__all__ = ["PARAMETERS", "SCRATCH_ROWS", "elastic_trial", "plastic_correction", "solid_block", "spin"]

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

SCRATCH_ROWS = 204
"""Rows of `LANES` doubles that a block of any kind needs."""


@kernel
def spin(rate: np.ndarray, step: float, rotation: np.ndarray) -> None:
    """Rotation of the step after Hughes and Winget (1980): Q = (1 - w/2)^-1 (1 + w/2), w = spin times step.

    `rate` (9 LANES,) 1/s, `rotation` (9 LANES,) rows 3 i + j. Exact for a rigid rotation of any size
    below half a turn, because the velocity gradient is taken on the mid-step configuration.
    """
    for lane in range(LANES):
        # Half the rotation vector of w.
        x = 0.25 * step * (rate[7 * LANES + lane] - rate[5 * LANES + lane])
        y = 0.25 * step * (rate[2 * LANES + lane] - rate[6 * LANES + lane])
        z = 0.25 * step * (rate[3 * LANES + lane] - rate[LANES + lane])
        f = 2.0 / (1.0 + x * x + y * y + z * z)
        rotation[lane] = 1.0 - f * (y * y + z * z)
        rotation[LANES + lane] = f * (x * y - z)
        rotation[2 * LANES + lane] = f * (z * x + y)
        rotation[3 * LANES + lane] = f * (x * y + z)
        rotation[4 * LANES + lane] = 1.0 - f * (z * z + x * x)
        rotation[5 * LANES + lane] = f * (y * z - x)
        rotation[6 * LANES + lane] = f * (z * x - y)
        rotation[7 * LANES + lane] = f * (y * z + x)
        rotation[8 * LANES + lane] = 1.0 - f * (x * x + y * y)


@kernel
def elastic_trial(
    stress: np.ndarray, rotation: np.ndarray, rate: np.ndarray, step: float, lame: float, shear: float
) -> None:
    """Rotate the stresses and add the elastic increment: sigma = Q sigma Q^T + lambda tr(de) 1 + 2 G de.

    `stress` (6 LANES,) Pa in place; `rotation` (9 LANES,); `rate` (9 LANES,) 1/s; `lame`, `shear` moduli (Pa).
    """
    for lane in range(LANES):
        xx, yy, zz = stress[lane], stress[LANES + lane], stress[2 * LANES + lane]
        xy, yz, zx = stress[3 * LANES + lane], stress[4 * LANES + lane], stress[5 * LANES + lane]
        q00, q01, q02 = rotation[lane], rotation[LANES + lane], rotation[2 * LANES + lane]
        q10, q11, q12 = rotation[3 * LANES + lane], rotation[4 * LANES + lane], rotation[5 * LANES + lane]
        q20, q21, q22 = rotation[6 * LANES + lane], rotation[7 * LANES + lane], rotation[8 * LANES + lane]
        a00, a01, a02 = q00 * xx + q01 * xy + q02 * zx, q00 * xy + q01 * yy + q02 * yz, q00 * zx + q01 * yz + q02 * zz
        a10, a11, a12 = q10 * xx + q11 * xy + q12 * zx, q10 * xy + q11 * yy + q12 * yz, q10 * zx + q11 * yz + q12 * zz
        a20, a21, a22 = q20 * xx + q21 * xy + q22 * zx, q20 * xy + q21 * yy + q22 * yz, q20 * zx + q21 * yz + q22 * zz
        exx, eyy, ezz = rate[lane] * step, rate[4 * LANES + lane] * step, rate[8 * LANES + lane] * step
        pressure = lame * (exx + eyy + ezz)
        twice = 2.0 * shear
        half = shear * step
        stress[lane] = a00 * q00 + a01 * q01 + a02 * q02 + pressure + twice * exx
        stress[LANES + lane] = a10 * q10 + a11 * q11 + a12 * q12 + pressure + twice * eyy
        stress[2 * LANES + lane] = a20 * q20 + a21 * q21 + a22 * q22 + pressure + twice * ezz
        stress[3 * LANES + lane] = (
            a00 * q10 + a01 * q11 + a02 * q12 + half * (rate[LANES + lane] + rate[3 * LANES + lane])
        )
        stress[4 * LANES + lane] = (
            a10 * q20 + a11 * q21 + a12 * q22 + half * (rate[5 * LANES + lane] + rate[7 * LANES + lane])
        )
        stress[5 * LANES + lane] = (
            a20 * q00 + a21 * q01 + a22 * q02 + half * (rate[6 * LANES + lane] + rate[2 * LANES + lane])
        )


@kernel
def plastic_correction(
    count: int,
    stress: np.ndarray,
    shear_strain: np.ndarray,
    volume_strain: np.ndarray,
    limit_scale: np.ndarray,
    material: np.ndarray,
    scratch: np.ndarray,
    dissipation: np.ndarray,
) -> None:
    """Return the plastic lanes of a block; elastic ones are told by a bound and left alone.

    Parameters
    ----------
    count : lanes that count.
    stress : (6 LANES,) trial stresses (Pa), in place.
    shear_strain, volume_strain : (LANES,) accumulated plastic strains, in place.
    limit_scale : (LANES,) inverse of the factor on the limit strains.
    material : row of the parameters.
    scratch : (27 LANES,).
    dissipation : (LANES,) plastic work per volume of this step (J/m3), overwritten.

    Notes
    -----
    (s1 - s3)/2 <= sqrt(J2) and s1 <= mean + 2 sqrt(J2/3), so most elastic lanes need no principal values. The plastic
    lanes are moved together, so that the return runs over full vectors.
    """
    tau0, sigma0 = material[2], material[3]
    packed = scratch[: 6 * LANES]
    tau = scratch[6 * LANES : 7 * LANES]
    sigma = scratch[7 * LANES : 8 * LANES]
    shear_step = scratch[8 * LANES : 9 * LANES]
    volume_step = scratch[9 * LANES : 10 * LANES]
    work = scratch[10 * LANES : 11 * LANES]
    matrix = scratch[11 * LANES : 17 * LANES]
    vectors = scratch[17 * LANES : 26 * LANES]
    flag = scratch[26 * LANES : 27 * LANES]
    for lane in range(LANES):
        xx, yy, zz = stress[lane], stress[LANES + lane], stress[2 * LANES + lane]
        xy, yz, zx = stress[3 * LANES + lane], stress[4 * LANES + lane], stress[5 * LANES + lane]
        mean = (xx + yy + zz) / 3.0
        xx -= mean
        yy -= mean
        zz -= mean
        j2 = 0.5 * (xx * xx + yy * yy + zz * zz) + xy * xy + yz * yz + zx * zx
        current_tau = softened_strength(tau0, shear_strain[lane], material[4] * limit_scale[lane])
        current_sigma = softened_strength(sigma0, volume_strain[lane], material[5] * limit_scale[lane])
        # The cut-off bound without a root: 4 J2 / 3 <= (sigma - mean)^2.
        room = max(current_sigma - mean, 0.0)
        elastic = j2 <= current_tau * current_tau and (4.0 / 3.0) * j2 <= room * room and mean <= current_sigma
        flag[lane] = 0.0 if elastic else 1.0
        tau[lane] = current_tau
        sigma[lane] = current_sigma
        dissipation[lane] = 0.0
    plastic = 0
    for lane in range(count):
        if flag[lane] > 0.0:
            for k in range(6):
                packed[k * LANES + plastic] = stress[k * LANES + lane]
            tau[plastic] = tau[lane]
            sigma[plastic] = sigma[lane]
            flag[plastic] = lane
            plastic += 1
    if plastic == 0:
        return
    for lane in range(plastic, LANES):
        for k in range(6):
            packed[k * LANES + lane] = 0.0
    return_stresses(packed, tau, sigma, material[0], material[1], matrix, vectors, shear_step, volume_step, work)
    for k in range(plastic):
        lane = int(flag[k])
        for row in range(6):
            stress[row * LANES + lane] = packed[row * LANES + k]
        shear_strain[lane] += shear_step[k]
        volume_strain[lane] += volume_step[k]
        dissipation[lane] = work[k]


@kernel
def solid_block(
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
    """Advance one block of solid cells by `step` (s) and add its nodal forces times `share`.

    Parameters
    ----------
    share : `step` over the longest that any cell takes.
    energy : (5,) J, added to: plastic, viscous, hourglass work of this step (entries 3 and 4 belong to the charge).
    limits : (4,): smallest stable step over `share` (s) and its cell, smallest volume (m3) and its cell; updated.
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
    shear_strain = scratch[132 * LANES : 133 * LANES]
    volume_strain = scratch[133 * LANES : 134 * LANES]
    dissipation = scratch[134 * LANES : 135 * LANES]
    power = scratch[135 * LANES : 136 * LANES]
    work = scratch[136 * LANES : 163 * LANES]
    fastest = scratch[163 * LANES : 164 * LANES]
    slope = scratch[164 * LANES : 167 * LANES]
    limit_scale = state.softening_scale[slot : slot + LANES]

    modulus, poisson = material[0], material[1]
    shear = 0.5 * modulus / (1.0 + poisson)
    lame = modulus * poisson / ((1.0 + poisson) * (1.0 - 2.0 * poisson))

    gather_modes(cells, grid.dofmap, nodes.position, position)
    gather_modes(cells, grid.dofmap, nodes.velocity, velocity)
    mid_step_modes(position, velocity, 0.5 * step, middle)
    mean_gradient(middle, gradient, volume)
    velocity_gradient(velocity, gradient, volume, rate)
    hourglass_rates(velocity, middle, rate, amplitude)
    mean_gradient(position, gradient, volume)

    for lane in range(LANES):
        cell = cells[lane]
        for k in range(6):
            stress[k * LANES + lane] = state.stress[cell, 0, k]
        shear_strain[lane] = state.shear_strain[cell, 0]
        volume_strain[lane] = state.volume_strain[cell, 0]
    spin(rate, step, rotation)
    elastic_trial(stress, rotation, rate, step, lame, shear)
    plastic_correction(
        count,
        stress,
        shear_strain,
        volume_strain,
        limit_scale,
        material,
        work,
        dissipation,
    )
    for lane in range(count):
        cell = cells[lane]
        for k in range(6):
            state.stress[cell, 0, k] = stress[k * LANES + lane]
        state.shear_strain[cell, 0] = shear_strain[lane]
        state.volume_strain[cell, 0] = volume_strain[lane]

    largest_gradient(gradient, volume, length)
    for lane in range(LANES):
        density[lane] = mass[lane] / volume[lane]
        sound[lane] = np.sqrt((lame + 2.0 * shear) / density[lane])
        # Without shear strength only the bulk modulus answers, and the step may be longer by a quarter.
        tau = softened_strength(material[2], shear_strain[lane], material[4] * limit_scale[lane])
        fastest[lane] = sound[lane] if tau > 0.0 else np.sqrt((lame + 2.0 / 3.0 * shear) / density[lane])
    step_and_viscosity(rate, length, density, sound, fastest, material[6], material[7], viscous, stable)
    _resist_hourglass(
        state.hourglass[block],
        rotation,
        position,
        gradient,
        slope,
        sound,
        density,
        length,
        volume,
        material[8],
        material[9],
        step,
        max(step, share * grid.longest),
        amplitude,
        power,
    )
    for lane in range(count):
        energy[0] += dissipation[lane] * volume[lane]
        # Mean of both ends of the step, as the forces work: at a front q changes within it.
        mean_viscous = 0.5 * (grid.viscous[slot + lane] + viscous[lane])
        energy[1] -= mean_viscous * (volume[lane] - grid.volume[slot + lane])
        grid.viscous[slot + lane] = viscous[lane]
        energy[2] += power[lane] * step
        grid.stable[slot + lane] = stable[lane]
        if stable[lane] < share * limits[0]:
            limits[0] = stable[lane] / share
            limits[1] = cells[lane]
        if not volume[lane] >= limits[2]:
            # Not a number must not be overwritten by the next cell.
            limits[2] = volume[lane] if volume[lane] == volume[lane] else -np.inf
            limits[3] = cells[lane]
        grid.volume[slot + lane] = volume[lane]
    force_modes(stress, viscous, amplitude, position, gradient, volume, velocity)
    add_nodal_forces(count, cells, grid.dofmap, velocity, share, nodes.rounding, nodes.force)


@kernel
def _resist_hourglass(
    stored: np.ndarray,
    rotation: np.ndarray,
    position: np.ndarray,
    gradient: np.ndarray,
    slope: np.ndarray,
    sound: np.ndarray,
    density: np.ndarray,
    length: np.ndarray,
    volume: np.ndarray,
    viscous: float,
    stiffness: float,
    step: float,
    bounded: float,
    amplitude: np.ndarray,
    power: np.ndarray,
) -> None:
    """Turn the hourglass rates into forces (N), viscous + stored elastic ones, in place; `power` (W) overwritten.

    Flanagan and Belytschko (1981), Eq. 59-62. The viscous coefficient multiplies rho c V/L / 4; the stiffness is
    given as a fraction of what full integration would give, about rho c^2 L / 36. The stored forces turn with the cell.
    Both are bounded by what a step of `bounded` (s) lets a cell bear whose hourglass vectors its distortion has made long.
    """
    gradient_norms(gradient, volume, slope)
    for lane in range(LANES):
        power[lane] = 0.0
    for a in range(4):
        mode = 3 if a == 0 else a + 4
        for lane in range(LANES):
            square = hourglass_square(lane, mode, position, slope)
            bearable = density[lane] * volume[lane] / (8.0 * square * bounded) if bounded > 0.0 else np.inf
            damping = 0.25 * viscous * density[lane] * sound[lane] * volume[lane] / length[lane]
            damping = min(damping, MOST_DAMPED * bearable)
            spring = stiffness / 36.0 * density[lane] * sound[lane] * sound[lane] * length[lane] * step
            spring = min(spring, _MOST_STIFF * bearable)
            x, y, z = (
                stored[(3 * a) * LANES + lane],
                stored[(3 * a + 1) * LANES + lane],
                stored[(3 * a + 2) * LANES + lane],
            )
            for i in range(3):
                q = amplitude[(3 * a + i) * LANES + lane]
                elastic = (
                    rotation[(3 * i) * LANES + lane] * x
                    + rotation[(3 * i + 1) * LANES + lane] * y
                    + rotation[(3 * i + 2) * LANES + lane] * z
                    + spring * q
                )
                stored[(3 * a + i) * LANES + lane] = elastic
                force = elastic + damping * q
                amplitude[(3 * a + i) * LANES + lane] = force
                power[lane] += force * q
