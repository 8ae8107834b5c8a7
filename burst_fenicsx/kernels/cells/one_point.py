"""The one-point hexahedron with its mean gradient and hourglass control (Flanagan and Belytschko 1981).

Hourglass control (Eq. 59-62) is viscous, and for solids elastic as well. The viscous coefficient multiplies
rho c V/L / 4; the stiffness is given as a fraction of what full integration would give, about rho c^2 L / 36. Both are
bounded by what the step lets a cell bear whose hourglass vectors its distortion has made long.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.cells.hexahedron import (
    PER_CELL,
    Gradient,
    Modes,
    cell_gradient,
    load_gradient,
    load_modes,
    modes_earlier,
    squared_gradients,
    store_gradient,
    store_nodal_forces,
)
from burst_fenicsx.kernels.constants import MOST_DAMPED, MOST_STIFF
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    Vector,
    add_outer,
    add_scaled,
    apply,
    dot,
    load_symmetric,
    load_vector,
    outer,
    scaled,
    store_vector,
    subtract_from_product,
)

_ROOT_8 = np.sqrt(8.0)

STORED_ROWS = 12
"""Numbers of elastic hourglass forces that a cell stores, three of each mode."""


@block_kernel
def velocity_gradient(step: float, scratch: np.ndarray) -> None:
    """Mean velocity gradient and hourglass rates of the cells in a step (s), and their shape after it.

    The velocity gradient is the mean one on the mid-step configuration. The hourglass rates are
    q_ia = sum over nodes of gamma_a v_i (Flanagan and Belytschko 1981, Eq. 43-51): gamma is the mode less its linear
    part, so that rigid motion and uniform strain excite none. The length L, c dt <= L, is 2 c over the highest
    frequency, see `squared_gradients`.
    """
    widest_vectors()
    for lane in range(LANES):
        position, velocity = load_modes(scratch, at.POSITION, lane), load_modes(scratch, at.VELOCITY, lane)
        middle = modes_earlier(position, -0.5 * step, velocity)
        gradient, volume = cell_gradient(middle)
        inverse = 1.0 / volume
        _move_component(0, middle, gradient, inverse, scratch, lane)
        _move_component(1, middle, gradient, inverse, scratch, lane)
        _move_component(2, middle, gradient, inverse, scratch, lane)
        xx, yy = scratch[at.RATE * LANES + lane], scratch[(at.RATE + 4) * LANES + lane]
        scratch[at.DILATATION * LANES + lane] = xx + yy + scratch[(at.RATE + 8) * LANES + lane]
    for lane in range(LANES):  # in one loop more would go through the stack than in two
        gradient, volume = cell_gradient(load_modes(scratch, at.POSITION, lane))
        store_gradient(gradient, scratch, at.GRADIENT, lane)
        (xx, yy, zz), largest = squared_gradients(gradient)
        inverse = 1.0 / volume
        scratch[at.VOLUME * LANES + lane] = scratch[at.MIN_VOLUME * LANES + lane] = PER_CELL * volume
        frequency = inverse * np.sqrt(16.0 * largest)
        scratch[at.FREQUENCY * LANES + lane], scratch[at.LENGTH * LANES + lane] = frequency, 1.0 / frequency
        square = 8.0 * inverse * inverse
        store_vector((square * xx, square * yy, square * zz), scratch, at.GRADIENT_SQUARES, lane)


@lane_function
def _move_component(i: int, middle: Modes, gradient: Gradient, inverse: float, scratch: np.ndarray, lane: int) -> None:
    """Row i of the mean velocity gradient L_ij = sum of v_ai b_aj / V, and that component of the hourglass rates.

    `middle` are the modes of the positions half a step ago, `gradient` and `inverse` what `cell_gradient` makes of
    them, the volume inverted.
    """
    v1, v2 = scratch[(at.VELOCITY + 3 + i) * LANES + lane], scratch[(at.VELOCITY + 6 + i) * LANES + lane]
    v3, v4 = scratch[(at.VELOCITY + 9 + i) * LANES + lane], scratch[(at.VELOCITY + 12 + i) * LANES + lane]
    v5, v6 = scratch[(at.VELOCITY + 15 + i) * LANES + lane], scratch[(at.VELOCITY + 18 + i) * LANES + lane]
    v7 = scratch[(at.VELOCITY + 21 + i) * LANES + lane]
    row = scaled(v1, gradient[0])
    row = add_scaled(row, v2, gradient[1])
    row = add_scaled(row, v3, gradient[2])
    row = add_scaled(row, v4, gradient[3])
    row = add_scaled(row, v5, gradient[4])
    row = scaled(inverse, add_scaled(row, v6, gradient[5]))
    store_vector(row, scratch, at.RATE + 3 * i, lane)
    scratch[(at.HOURGLASS_RATE + i) * LANES + lane] = v3 - dot(row, middle[2])
    scratch[(at.HOURGLASS_RATE + 3 + i) * LANES + lane] = v5 - dot(row, middle[4])
    scratch[(at.HOURGLASS_RATE + 6 + i) * LANES + lane] = v6 - dot(row, middle[5])
    scratch[(at.HOURGLASS_RATE + 9 + i) * LANES + lane] = v7 - dot(row, middle[6])


@lane_function
def force_modes(scratch: np.ndarray, lane: int) -> Modes:
    """Modes of the nodal forces (N), f_a = -sigma b_a - Q gamma_a: stress less pressures, and hourglass forces."""
    h3, h5 = load_vector(scratch, at.HOURGLASS_FORCE, lane), load_vector(scratch, at.HOURGLASS_FORCE + 3, lane)
    h6, h7 = load_vector(scratch, at.HOURGLASS_FORCE + 6, lane), load_vector(scratch, at.HOURGLASS_FORCE + 9, lane)
    # The linear part of gamma acts like a stress, which need not be symmetric.
    linear = outer(h3, load_vector(scratch, at.HOURGLASS_MODES[0], lane))
    linear = add_outer(linear, h5, load_vector(scratch, at.HOURGLASS_MODES[1], lane))
    linear = add_outer(linear, h6, load_vector(scratch, at.HOURGLASS_MODES[2], lane))
    linear = add_outer(linear, h7, load_vector(scratch, at.HOURGLASS_MODES[3], lane))
    xx, yy, zz, xy, yz, zx = load_symmetric(scratch, at.STRESS, lane)
    pressure = scratch[at.PRESSURE * LANES + lane] + scratch[at.VISCOUS * LANES + lane]
    factor = PER_CELL / scratch[at.VOLUME * LANES + lane]
    pull = (
        add_scaled(scaled(-PER_CELL, (xx - pressure, xy, zx)), factor, linear[0]),
        add_scaled(scaled(-PER_CELL, (xy, yy - pressure, yz)), factor, linear[1]),
        add_scaled(scaled(-PER_CELL, (zx, yz, zz - pressure)), factor, linear[2]),
    )
    p, q, s3, r, s5, s6 = load_gradient(scratch, at.GRADIENT, lane)
    return (
        apply(pull, p),
        apply(pull, q),
        subtract_from_product(pull, s3, h3),
        apply(pull, r),
        subtract_from_product(pull, s5, h5),
        subtract_from_product(pull, s6, h6),
        scaled(-1.0, h7),
    )


@block_kernel
def nodal_forces(fraction: float, rounding: float, scratch: np.ndarray) -> None:
    """Nodal forces (N) of stress, pressures and hourglass control, times `fraction`, rounded (see `exact.quantise`)."""
    widest_vectors()
    for lane in range(LANES):
        store_nodal_forces(force_modes(scratch, lane), fraction, rounding, scratch, at.FORCE, lane)


@lane_function
def turn_stored(rotation: Matrix, scratch: np.ndarray, lane: int) -> None:
    """Turn the stored elastic forces with the cell."""
    h3, h5 = load_vector(scratch, at.HOURGLASS_STORED, lane), load_vector(scratch, at.HOURGLASS_STORED + 3, lane)
    h6, h7 = load_vector(scratch, at.HOURGLASS_STORED + 6, lane), load_vector(scratch, at.HOURGLASS_STORED + 9, lane)
    store_vector(apply(rotation, h3), scratch, at.HOURGLASS_STORED, lane)
    store_vector(apply(rotation, h5), scratch, at.HOURGLASS_STORED + 3, lane)
    store_vector(apply(rotation, h6), scratch, at.HOURGLASS_STORED + 6, lane)
    store_vector(apply(rotation, h7), scratch, at.HOURGLASS_STORED + 9, lane)


@lane_function
def longest_square(scratch: np.ndarray, lane: int) -> float:
    """Bound on the squares of all four hourglass vectors of a cell.

    Without roots: (sqrt(8) + x)^2 <= 10 + 5 x^2, and x^2 is at most |h x|^2 times the sum of |b_i|^2 / V^2.
    A little more allows for rounding: a cell's forces must not depend on whether others of its block need the bound.
    """
    h3, h5 = load_vector(scratch, at.HOURGLASS_MODES[0], lane), load_vector(scratch, at.HOURGLASS_MODES[1], lane)
    h6, h7 = load_vector(scratch, at.HOURGLASS_MODES[2], lane), load_vector(scratch, at.HOURGLASS_MODES[3], lane)
    mode_square = max(dot(h3, h3), dot(h5, h5), dot(h6, h6), dot(h7, h7))
    sx, sy, sz = load_vector(scratch, at.GRADIENT_SQUARES, lane)
    return 10.01 + 5.01 * mode_square * (sx + sy + sz)


@block_kernel
def hourglass_coefficients(
    viscous: float, stiffness: float, modulus: float, step: float, next_dt: float, scratch: np.ndarray
) -> None:
    """Coefficients of hourglass control, and what the next step, `next_dt` (s), lets each cell bear of them.

    `viscous` and `stiffness` are dimensionless, `modulus` (Pa) is that of a plane wave; `step` (s) is the last one.
    Where no cell of the block can come near its limit, there is none.
    """
    widest_vectors()
    per_step = 1.0 / next_dt if next_dt > 0.0 else np.inf
    near = 0
    for lane in range(LANES):
        frequency, mass = scratch[at.FREQUENCY * LANES + lane], scratch[at.MASS * LANES + lane]
        damping = 0.25 * viscous * mass * scratch[at.SOUND * LANES + lane] * frequency
        spring = stiffness / 36.0 * modulus * step * scratch[at.LENGTH * LANES + lane]
        scratch[at.DAMPING * LANES + lane], scratch[at.SPRING * LANES + lane] = damping, spring
        most = max(damping * (1.0 / MOST_DAMPED), spring * (1.0 / MOST_STIFF))
        near += 1 if most * longest_square(scratch, lane) > mass * (0.125 * per_step) else 0
    if near == 0:
        for k in range(4 * LANES):
            scratch[at.COEFFICIENT_LIMIT * LANES + k] = np.inf
        return
    for lane in range(LANES):
        sx, sy, sz = load_vector(scratch, at.GRADIENT_SQUARES, lane)
        gradient_norm = (np.sqrt(sx), np.sqrt(sy), np.sqrt(sz))
        coefficient_limit = scratch[at.MASS * LANES + lane] / (8.0 * next_dt)
        _limit_mode(0, coefficient_limit, gradient_norm, scratch, lane)  # a loop over the modes is not vectorised
        _limit_mode(1, coefficient_limit, gradient_norm, scratch, lane)
        _limit_mode(2, coefficient_limit, gradient_norm, scratch, lane)
        _limit_mode(3, coefficient_limit, gradient_norm, scratch, lane)


@lane_function
def _limit_mode(a: int, limit: float, gradient_norm: Vector, scratch: np.ndarray, lane: int) -> None:
    square = vector_square(load_vector(scratch, at.HOURGLASS_MODES[a], lane), gradient_norm)
    scratch[(at.COEFFICIENT_LIMIT + a) * LANES + lane] = limit / square


@lane_function
def vector_square(mode: Vector, gradient_norm: Vector) -> float:
    """Bound on the square of an hourglass vector, |gamma| <= sqrt(8) + sum over i of |h x_i| |b_i| / V.

    8 in a brick; large where a cell is warped by more than it is thick. `mode` is that of the positions (m).
    """
    size = _ROOT_8 + abs(mode[0]) * gradient_norm[0] + abs(mode[1]) * gradient_norm[1] + abs(mode[2]) * gradient_norm[2]
    return size * size


@block_kernel
def dashpots(scratch: np.ndarray) -> None:
    """Viscous forces (N) against the modes, with the coefficient that all four bear, and their power (W)."""
    widest_vectors()
    for lane in range(LANES):
        b3, b5 = scratch[at.COEFFICIENT_LIMIT * LANES + lane], scratch[(at.COEFFICIENT_LIMIT + 1) * LANES + lane]
        b6, b7 = scratch[(at.COEFFICIENT_LIMIT + 2) * LANES + lane], scratch[(at.COEFFICIENT_LIMIT + 3) * LANES + lane]
        damping = min(scratch[at.DAMPING * LANES + lane], MOST_DAMPED * min(b3, b5, b6, b7))
        q3, q5 = load_vector(scratch, at.HOURGLASS_RATE, lane), load_vector(scratch, at.HOURGLASS_RATE + 3, lane)
        q6, q7 = load_vector(scratch, at.HOURGLASS_RATE + 6, lane), load_vector(scratch, at.HOURGLASS_RATE + 9, lane)
        store_vector(scaled(damping, q3), scratch, at.HOURGLASS_FORCE, lane)
        store_vector(scaled(damping, q5), scratch, at.HOURGLASS_FORCE + 3, lane)
        store_vector(scaled(damping, q6), scratch, at.HOURGLASS_FORCE + 6, lane)
        store_vector(scaled(damping, q7), scratch, at.HOURGLASS_FORCE + 9, lane)
        power = damping * (dot(q3, q3) + dot(q5, q5) + dot(q6, q6) + dot(q7, q7))
        scratch[at.HOURGLASS_POWER * LANES + lane] = power


@lane_function
def resist_mode(a: int, scratch: np.ndarray, lane: int) -> float:
    """Set the force (N) against one mode, viscous and stored elastic one; its power (W).

    The stored forces have been turned with the cell; they are advanced.
    """
    rate = load_vector(scratch, at.HOURGLASS_RATE + 3 * a, lane)
    coefficient_limit = scratch[(at.COEFFICIENT_LIMIT + a) * LANES + lane]
    spring = min(scratch[at.SPRING * LANES + lane], MOST_STIFF * coefficient_limit)
    elastic = add_scaled(load_vector(scratch, at.HOURGLASS_STORED + 3 * a, lane), spring, rate)
    store_vector(elastic, scratch, at.HOURGLASS_STORED + 3 * a, lane)
    force = add_scaled(elastic, min(scratch[at.DAMPING * LANES + lane], MOST_DAMPED * coefficient_limit), rate)
    store_vector(force, scratch, at.HOURGLASS_FORCE + 3 * a, lane)
    return dot(force, rate)


@block_kernel
def springs_and_dashpots(scratch: np.ndarray) -> None:
    """Elastic and viscous forces (N) against the modes and their power (W)."""
    widest_vectors()
    for lane in range(LANES):
        p3, p5 = resist_mode(0, scratch, lane), resist_mode(1, scratch, lane)
        p6, p7 = resist_mode(2, scratch, lane), resist_mode(3, scratch, lane)
        scratch[at.HOURGLASS_POWER * LANES + lane] = p3 + p5 + p6 + p7
