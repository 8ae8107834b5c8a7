"""What solid and charge cells share: how a block moves, viscosity and stable step, hourglass control, forces.

A block's scratch is flat, entry `lane` of row `k` at `k * LANES + lane`. The rows named here hold what one loop over the
lanes leaves to the next one; since all rows lie at constant distances, the compiler sees that they do not overlap.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.hexahedron import (
    Gradient,
    Modes,
    cell_gradient,
    cell_modes,
    squared_gradients,
    store_gradient,
    velocity_gradient,
)
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function
from burst_fenicsx.kernels.tensors import (
    Matrix,
    Symmetric,
    Vector,
    add_outer,
    add_scaled,
    apply,
    load_vector,
    outer,
    scaled,
    store_matrix,
    store_vector,
    subtract_applied,
)

__all__ = [
    "FORCE",
    "FREE",
    "FREQUENCY",
    "GRADIENT",
    "HOURGLASS",
    "MOST_DAMPED",
    "POSITION",
    "RATE",
    "SLOPE",
    "VELOCITY",
    "VOLUME",
    "WARP",
    "force_modes",
    "hourglass_square",
    "move_cells",
    "viscosity_and_step",
]

POSITION, VELOCITY = 0, 24  # nodal values, m and m/s
FORCE = 0  # nodal values, N; in the place of the positions
GRADIENT = 48  # 18 rows, m2
WARP = 66  # hourglass modes 3, 5, 6, 7 of the positions, 12 rows, m
RATE = 78  # velocity gradient, 9 rows, 1/s
HOURGLASS = 87  # hourglass rates of the modes 3, 5, 6, 7, 12 rows, m/s
VOLUME = 99  # m3
FREQUENCY = 100  # inverse of the length that governs the stable step, 1/m
SLOPE = 101  # norms of the mean gradient over the nodes over the volume, 3 rows, 1/m
FREE = 104  # first row for the material's own

MOST_DAMPED = 1.0
"""Share of an hourglass rate that viscosity may take away in one step; beyond it the rate would change its sign."""

_ROOT_8 = np.sqrt(8.0)


@block_kernel
def move_cells(step: float, scratch: np.ndarray) -> None:
    """From nodal places and velocities to all that describes the cells' motion in the step (s) and their shape after it.

    The velocity gradient is the mean one on the mid-step configuration. The hourglass rates are
    q_ia = sum over nodes of gamma_a v_i (Flanagan and Belytschko 1981, Eq. 43-51): gamma is the mode less its linear
    part, so that rigid motion and uniform strain excite none. The length L, c dt <= L, is 2 c over the highest
    frequency, see `squared_gradients`.
    """
    for lane in range(LANES):
        place, velocity = cell_modes(scratch, POSITION, lane), cell_modes(scratch, VELOCITY, lane)
        # The transform is linear, so the places half a step ago need no gather of their own.
        middle = _half_step_ago(place, velocity, -0.5 * step)
        gradient, volume = cell_gradient(middle)
        rate = velocity_gradient(velocity, gradient, 1.0 / volume)
        store_matrix(rate, scratch, RATE, lane)
        store_vector(subtract_applied(velocity[2], rate, middle[2]), scratch, HOURGLASS, lane)
        store_vector(subtract_applied(velocity[4], rate, middle[4]), scratch, HOURGLASS + 3, lane)
        store_vector(subtract_applied(velocity[5], rate, middle[5]), scratch, HOURGLASS + 6, lane)
        store_vector(subtract_applied(velocity[6], rate, middle[6]), scratch, HOURGLASS + 9, lane)
        gradient, volume = cell_gradient(place)
        store_gradient(gradient, scratch, GRADIENT, lane)
        store_vector(place[2], scratch, WARP, lane)
        store_vector(place[4], scratch, WARP + 3, lane)
        store_vector(place[5], scratch, WARP + 6, lane)
        store_vector(place[6], scratch, WARP + 9, lane)
        (xx, yy, zz), largest = squared_gradients(gradient)
        inverse = 1.0 / volume
        scratch[VOLUME * LANES + lane] = volume
        scratch[FREQUENCY * LANES + lane] = inverse * np.sqrt(16.0 * largest)
        scratch[SLOPE * LANES + lane] = inverse * np.sqrt(8.0 * xx)
        scratch[(SLOPE + 1) * LANES + lane] = inverse * np.sqrt(8.0 * yy)
        scratch[(SLOPE + 2) * LANES + lane] = inverse * np.sqrt(8.0 * zz)


@lane_function
def _half_step_ago(place: Modes, velocity: Modes, back: float) -> Modes:
    """Modes of the places `back` (s, negative) from now."""
    return (
        add_scaled(place[0], back, velocity[0]),
        add_scaled(place[1], back, velocity[1]),
        add_scaled(place[2], back, velocity[2]),
        add_scaled(place[3], back, velocity[3]),
        add_scaled(place[4], back, velocity[4]),
        add_scaled(place[5], back, velocity[5]),
        add_scaled(place[6], back, velocity[6]),
    )


@lane_function
def viscosity_and_step(
    dilatation: float,
    frequency: float,
    density: float,
    sound: float,
    fastest: float,
    linear: float,
    quadratic: float,
) -> tuple[float, float]:
    """Artificial viscous pressure q (Pa) in compression and the stable step (s) with it.

    q = rho L |D| (q1 c + q2 L |D|), D the rate of volume (von Neumann and Richtmyer 1950, Landshoff 1955), L the
    inverse of `frequency`. The damped mode of frequency omega = 2 c/L with the ratio zeta = q1 + q2 L |D| / c of the
    critical damping allows dt <= (2/omega) (sqrt(1 + zeta^2) - zeta) (Belytschko et al. 2000, section 6.2).
    `fastest` is the sound speed that the step must allow for.
    """
    length = 1.0 / frequency
    closing = length * max(-dilatation, 0.0)
    speed = quadratic * closing
    damped = linear * fastest + speed if dilatation < 0.0 else 0.0
    viscous = density * closing * (linear * sound + speed)
    return viscous, length / (np.sqrt(fastest * fastest + damped * damped) + damped)


@lane_function
def hourglass_square(warp: Vector, slope: Vector) -> float:
    """Bound on the square of an hourglass vector, |gamma| <= sqrt(8) + sum over i of |h x_i| |b_i| / V.

    8 in a brick; large where a cell is warped by more than it is thick. `warp` is the mode of the positions (m).
    """
    size = _ROOT_8 + abs(warp[0]) * slope[0] + abs(warp[1]) * slope[1] + abs(warp[2]) * slope[2]
    return size * size


@lane_function
def force_modes(
    stress: Symmetric,
    resistance: tuple[Vector, Vector, Vector, Vector],
    gradient: Gradient,
    volume: float,
    scratch: np.ndarray,
    lane: int,
) -> Modes:
    """Modes of the nodal forces (N), f_a = -sigma b_a - Q gamma_a.

    Parameters
    ----------
    stress : sigma with the viscous pressure taken off (Pa).
    resistance : generalised hourglass forces Q of the modes 3, 5, 6, 7 (N).
    gradient, volume : of the same configuration (m2, m3).
    scratch : its rows `WARP` are read.
    """
    h3, h5, h6, h7 = resistance
    # The linear part of gamma acts like a stress, which need not be symmetric.
    linear = outer(h3, load_vector(scratch, WARP, lane))
    linear = add_outer(linear, h5, load_vector(scratch, WARP + 3, lane))
    linear = add_outer(linear, h6, load_vector(scratch, WARP + 6, lane))
    linear = add_outer(linear, h7, load_vector(scratch, WARP + 9, lane))
    xx, yy, zz, xy, yz, zx = stress
    pull = _opposed(linear, 1.0 / volume, ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz)))
    p, q, s3, r, s5, s6 = gradient
    return (
        apply(pull, p),
        apply(pull, q),
        add_scaled(apply(pull, s3), -1.0, h3),
        apply(pull, r),
        add_scaled(apply(pull, s5), -1.0, h5),
        add_scaled(apply(pull, s6), -1.0, h6),
        scaled(-1.0, h7),
    )


@lane_function
def _opposed(matrix: Matrix, factor: float, stress: Matrix) -> Matrix:
    """Matrix k M - sigma."""
    x, y, z = stress
    return (
        add_scaled(scaled(-1.0, x), factor, matrix[0]),
        add_scaled(scaled(-1.0, y), factor, matrix[1]),
        add_scaled(scaled(-1.0, z), factor, matrix[2]),
    )
