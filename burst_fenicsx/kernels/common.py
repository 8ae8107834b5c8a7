"""What solid and charge cells share: viscosity and stable step, hourglass control, forces."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, kernel

__all__ = [
    "MOST_DAMPED",
    "force_modes",
    "gradient_norms",
    "hourglass_rates",
    "hourglass_square",
    "resist_hourglass",
    "step_and_viscosity",
]

MOST_DAMPED = 1.0
"""Share of an hourglass rate that viscosity may take away in one step; beyond it the rate would change its sign."""

# Row of the stress component (i, j) in the order xx, yy, zz, xy, yz, zx.
_ROW = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2]])


@kernel
def step_and_viscosity(
    rate: np.ndarray,
    length: np.ndarray,
    density: np.ndarray,
    sound: np.ndarray,
    fastest: np.ndarray,
    linear: float,
    quadratic: float,
    viscous: np.ndarray,
    stable: np.ndarray,
) -> None:
    """Artificial viscous pressure q (Pa) in compression and the stable step (s) with it.

    q = rho L |D| (q1 c + q2 L |D|), D the rate of volume (von Neumann and Richtmyer 1950, Landshoff 1955).
    The damped mode of frequency omega = 2 c/L with the ratio zeta = q1 + q2 L |D| / c of the critical
    damping allows dt <= (2/omega) (sqrt(1 + zeta^2) - zeta) (Belytschko et al. 2000, section 6.2).
    `fastest` is the sound speed that the step must allow for; all arrays (LANES,), `rate` (9 LANES,).
    """
    for lane in range(LANES):
        dilatation = rate[lane] + rate[4 * LANES + lane] + rate[8 * LANES + lane]
        compression = max(-dilatation, 0.0)
        speed = quadratic * length[lane] * compression
        viscous[lane] = density[lane] * length[lane] * compression * (linear * sound[lane] + speed)
        c = fastest[lane]
        damped = linear * c + speed if compression > 0.0 else 0.0
        stable[lane] = length[lane] / (np.sqrt(c * c + damped * damped) + damped)


@kernel
def hourglass_rates(velocity: np.ndarray, middle: np.ndarray, rate: np.ndarray, amplitude: np.ndarray) -> None:
    """Hourglass rates q_ia = sum over nodes of gamma_a v_i (m/s), rows 3 a + i, of the modes 3, 5, 6, 7.

    Flanagan and Belytschko (1981), Eq. 43-51: gamma is the mode less its linear part, so that rigid motion
    and uniform strain excite none. Velocities and the mid-step positions `middle` enter by their modes.
    """
    for a in range(4):
        mode = 3 if a == 0 else a + 4
        for i in range(3):
            for lane in range(LANES):
                amplitude[(3 * a + i) * LANES + lane] = (
                    velocity[(3 * mode + i) * LANES + lane]
                    - rate[(3 * i) * LANES + lane] * middle[(3 * mode) * LANES + lane]
                    - rate[(3 * i + 1) * LANES + lane] * middle[(3 * mode + 1) * LANES + lane]
                    - rate[(3 * i + 2) * LANES + lane] * middle[(3 * mode + 2) * LANES + lane]
                )


@kernel
def gradient_norms(gradient: np.ndarray, volume: np.ndarray, slope: np.ndarray) -> None:
    """Norms of the mean gradient over the nodes, |b_i| / V (1/m), rows i of `slope` (3 LANES,), overwritten.

    `gradient` (18 LANES,) and `volume` (LANES,) as from `mean_gradient`.
    """
    for i in range(3):
        for lane in range(LANES):
            square = 0.0
            for k in range(6):
                square += gradient[(3 * k + i) * LANES + lane] ** 2
            slope[i * LANES + lane] = np.sqrt(8.0 * square) / volume[lane]


@kernel
def hourglass_square(lane: int, mode: int, position: np.ndarray, slope: np.ndarray) -> float:
    """Bound on the square of an hourglass vector, |gamma| <= sqrt(8) + sum over i of |h x_i| |b_i| / V.

    8 in a brick; large where a cell is warped by more than it is thick. `position` (24 LANES,) modes (m).
    """
    size = np.sqrt(8.0)
    for i in range(3):
        size += abs(position[(3 * mode + i) * LANES + lane]) * slope[i * LANES + lane]
    return size * size


@kernel
def resist_hourglass(coefficient: np.ndarray, amplitude: np.ndarray, power: np.ndarray) -> None:
    """Turn the hourglass rates into viscous generalised forces (N) in place; `power` (W) is overwritten."""
    for lane in range(LANES):
        power[lane] = 0.0
    for k in range(12):
        for lane in range(LANES):
            q = amplitude[k * LANES + lane]
            amplitude[k * LANES + lane] = coefficient[lane] * q
            power[lane] += coefficient[lane] * q * q


@kernel
def force_modes(
    stress: np.ndarray,
    viscous: np.ndarray,
    resistance: np.ndarray,
    position: np.ndarray,
    gradient: np.ndarray,
    volume: np.ndarray,
    modes: np.ndarray,
) -> None:
    """Modes of the nodal forces (N), f_a = -(sigma - q 1) b_a - Q gamma_a.

    Parameters
    ----------
    stress : (6 LANES,) Pa; viscous : (LANES,) Pa.
    resistance : (12 LANES,) generalised hourglass forces Q, rows 3 a + i (N).
    position : (24 LANES,) modes of the positions (m).
    gradient, volume : as from `mean_gradient`, on the same configuration.
    modes : (24 LANES,), overwritten.
    """
    for i in range(3):
        ix, iy, iz = _ROW[i, 0], _ROW[i, 1], _ROW[i, 2]
        for lane in range(LANES):
            inverse = 1.0 / volume[lane]
            h3 = resistance[(0 + i) * LANES + lane]
            h5 = resistance[(3 + i) * LANES + lane]
            h6 = resistance[(6 + i) * LANES + lane]
            h7 = resistance[(9 + i) * LANES + lane]
            q = viscous[lane]
            # The linear part of gamma acts like a stress, which need not be symmetric.
            tx = (
                (q if i == 0 else 0.0)
                - stress[ix * LANES + lane]
                + inverse
                * (
                    h3 * position[9 * LANES + lane]
                    + h5 * position[15 * LANES + lane]
                    + h6 * position[18 * LANES + lane]
                    + h7 * position[21 * LANES + lane]
                )
            )
            ty = (
                (q if i == 1 else 0.0)
                - stress[iy * LANES + lane]
                + inverse
                * (
                    h3 * position[10 * LANES + lane]
                    + h5 * position[16 * LANES + lane]
                    + h6 * position[19 * LANES + lane]
                    + h7 * position[22 * LANES + lane]
                )
            )
            tz = (
                (q if i == 2 else 0.0)
                - stress[iz * LANES + lane]
                + inverse
                * (
                    h3 * position[11 * LANES + lane]
                    + h5 * position[17 * LANES + lane]
                    + h6 * position[20 * LANES + lane]
                    + h7 * position[23 * LANES + lane]
                )
            )
            modes[i * LANES + lane] = 0.0
            modes[(3 + i) * LANES + lane] = (
                tx * gradient[lane] + ty * gradient[LANES + lane] + tz * gradient[2 * LANES + lane]
            )
            modes[(6 + i) * LANES + lane] = (
                tx * gradient[3 * LANES + lane] + ty * gradient[4 * LANES + lane] + tz * gradient[5 * LANES + lane]
            )
            modes[(12 + i) * LANES + lane] = (
                tx * gradient[6 * LANES + lane] + ty * gradient[7 * LANES + lane] + tz * gradient[8 * LANES + lane]
            )
            modes[(9 + i) * LANES + lane] = (
                tx * gradient[9 * LANES + lane] + ty * gradient[10 * LANES + lane] + tz * gradient[11 * LANES + lane]
            ) - h3
            modes[(15 + i) * LANES + lane] = (
                tx * gradient[12 * LANES + lane] + ty * gradient[13 * LANES + lane] + tz * gradient[14 * LANES + lane]
            ) - h5
            modes[(18 + i) * LANES + lane] = (
                tx * gradient[15 * LANES + lane] + ty * gradient[16 * LANES + lane] + tz * gradient[17 * LANES + lane]
            ) - h6
            modes[(21 + i) * LANES + lane] = -h7
