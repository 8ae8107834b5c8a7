"""Hourglass control of the one-point hexahedron: viscous, and for solids elastic as well.

Flanagan and Belytschko (1981), Eq. 59-62. The viscous coefficient multiplies rho c V/L / 4; the stiffness is given as a
fraction of what full integration would give, about rho c^2 L / 36. Both are bounded by what the step lets a cell bear
whose hourglass vectors its distortion has made long.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.constants import MOST_DAMPED, MOST_STIFF
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    Vector,
    add_scaled,
    apply,
    dot,
    load_vector,
    scaled,
    store_vector,
)

__all__ = [
    "Forces",
    "bound",
    "dashpots",
    "longest_square",
    "may_exceed",
    "resist_mode",
    "set_damping",
    "set_stiffness",
    "springs_and_dashpots",
    "turn_stored",
    "vector_square",
]

Forces = tuple[Vector, Vector, Vector, Vector]

_ROOT_8 = np.sqrt(8.0)


@lane_function
def turn_stored(rotation: Matrix, scratch: np.ndarray, lane: int) -> None:
    """Turn the stored elastic forces with the cell."""
    store_vector(apply(rotation, load_vector(scratch, at.HOURGLASS_FORCE, lane)), scratch, at.HOURGLASS_FORCE, lane)
    store_vector(
        apply(rotation, load_vector(scratch, at.HOURGLASS_FORCE + 3, lane)), scratch, at.HOURGLASS_FORCE + 3, lane
    )
    store_vector(
        apply(rotation, load_vector(scratch, at.HOURGLASS_FORCE + 6, lane)), scratch, at.HOURGLASS_FORCE + 6, lane
    )
    store_vector(
        apply(rotation, load_vector(scratch, at.HOURGLASS_FORCE + 9, lane)), scratch, at.HOURGLASS_FORCE + 9, lane
    )


@lane_function
def set_damping(viscous: float, sound: float, scratch: np.ndarray, lane: int) -> float:
    """Set the viscous coefficient of a lane from the dimensionless one; what the step must bear (N s/m)."""
    damping = 0.25 * viscous * scratch[at.MASS * LANES + lane] * sound * scratch[at.FREQUENCY * LANES + lane]
    scratch[at.DAMPING * LANES + lane] = damping
    return damping * (1.0 / MOST_DAMPED)


@lane_function
def set_stiffness(fraction: float, modulus: float, step: float, scratch: np.ndarray, lane: int) -> float:
    """Set the springs' coefficient of a lane for a step (s), `modulus` (Pa) that of a plane wave; likewise."""
    spring = fraction / 36.0 * modulus * step * (1.0 / scratch[at.FREQUENCY * LANES + lane])
    scratch[at.SPRING * LANES + lane] = spring
    return spring * (1.0 / MOST_STIFF)


@lane_function
def longest_square(scratch: np.ndarray, lane: int) -> float:
    """Bound on the squares of all four hourglass vectors of a cell.

    Without roots: (sqrt(8) + x)^2 <= 10 + 5 x^2, and x^2 is at most |h x|^2 times the sum of |b_i|^2 / V^2.
    A little more allows for rounding: a cell's forces must not depend on whether others of its block need the bound.
    """
    h3, h5 = load_vector(scratch, at.HOURGLASS_MODES, lane), load_vector(scratch, at.HOURGLASS_MODES + 3, lane)
    h6, h7 = load_vector(scratch, at.HOURGLASS_MODES + 6, lane), load_vector(scratch, at.HOURGLASS_MODES + 9, lane)
    mode_square = max(dot(h3, h3), dot(h5, h5), dot(h6, h6), dot(h7, h7))
    sx, sy, sz = load_vector(scratch, at.GRADIENT_SQUARES, lane)
    return 10.01 + 5.01 * mode_square * (sx + sy + sz)


@lane_function
def may_exceed(coefficient: float, per_step: float, scratch: np.ndarray, lane: int) -> bool:
    """Whether an hourglass coefficient may exceed what the step, of inverse `per_step` (1/s), bears."""
    limit = scratch[at.MASS * LANES + lane] * (0.125 * per_step)
    return coefficient * longest_square(scratch, lane) > limit


@lane_function
def vector_square(mode: Vector, gradient_norm: Vector) -> float:
    """Bound on the square of an hourglass vector, |gamma| <= sqrt(8) + sum over i of |h x_i| |b_i| / V.

    8 in a brick; large where a cell is warped by more than it is thick. `mode` is that of the positions (m).
    """
    size = _ROOT_8 + abs(mode[0]) * gradient_norm[0] + abs(mode[1]) * gradient_norm[1] + abs(mode[2]) * gradient_norm[2]
    return size * size


@block_kernel
def bound(step: float, needed: bool, scratch: np.ndarray) -> None:
    """Find the hourglass coefficients that the step (s) lets each cell bear: where none is `needed`, without limit."""
    widest_vectors()
    if not needed:
        for k in range(4 * LANES):
            scratch[at.COEFFICIENT_LIMIT * LANES + k] = np.inf
        return
    for lane in range(LANES):
        sx, sy, sz = load_vector(scratch, at.GRADIENT_SQUARES, lane)
        gradient_norm = (np.sqrt(sx), np.sqrt(sy), np.sqrt(sz))
        coefficient_limit = scratch[at.MASS * LANES + lane] / (8.0 * step)
        for a in range(4):
            square = vector_square(load_vector(scratch, at.HOURGLASS_MODES + 3 * a, lane), gradient_norm)
            scratch[(at.COEFFICIENT_LIMIT + a) * LANES + lane] = coefficient_limit / square


@lane_function
def dashpots(scratch: np.ndarray, lane: int) -> tuple[Forces, float]:
    """Viscous forces (N) against the modes, with the coefficient that all four bear, and their power (W)."""
    b3, b5 = scratch[at.COEFFICIENT_LIMIT * LANES + lane], scratch[(at.COEFFICIENT_LIMIT + 1) * LANES + lane]
    b6, b7 = scratch[(at.COEFFICIENT_LIMIT + 2) * LANES + lane], scratch[(at.COEFFICIENT_LIMIT + 3) * LANES + lane]
    damping = min(scratch[at.DAMPING * LANES + lane], MOST_DAMPED * min(b3, b5, b6, b7))
    q3, q5 = load_vector(scratch, at.HOURGLASS_RATE, lane), load_vector(scratch, at.HOURGLASS_RATE + 3, lane)
    q6, q7 = load_vector(scratch, at.HOURGLASS_RATE + 6, lane), load_vector(scratch, at.HOURGLASS_RATE + 9, lane)
    power = damping * (dot(q3, q3) + dot(q5, q5) + dot(q6, q6) + dot(q7, q7))
    return (scaled(damping, q3), scaled(damping, q5), scaled(damping, q6), scaled(damping, q7)), power


@lane_function
def resist_mode(a: int, scratch: np.ndarray, lane: int) -> tuple[Vector, float]:
    """Force (N) against one mode, viscous and stored elastic one, and its power (W).

    The stored forces have been turned with the cell; they are advanced.
    """
    rate = load_vector(scratch, at.HOURGLASS_RATE + 3 * a, lane)
    coefficient_limit = scratch[(at.COEFFICIENT_LIMIT + a) * LANES + lane]
    spring = min(scratch[at.SPRING * LANES + lane], MOST_STIFF * coefficient_limit)
    elastic = add_scaled(load_vector(scratch, at.HOURGLASS_FORCE + 3 * a, lane), spring, rate)
    store_vector(elastic, scratch, at.HOURGLASS_FORCE + 3 * a, lane)
    force = add_scaled(elastic, min(scratch[at.DAMPING * LANES + lane], MOST_DAMPED * coefficient_limit), rate)
    return force, dot(force, rate)


@lane_function
def springs_and_dashpots(scratch: np.ndarray, lane: int) -> tuple[Forces, float]:
    """Elastic and viscous forces (N) against the modes and their power (W)."""
    h3, p3 = resist_mode(0, scratch, lane)
    h5, p5 = resist_mode(1, scratch, lane)
    h6, p6 = resist_mode(2, scratch, lane)
    h7, p7 = resist_mode(3, scratch, lane)
    return (h3, h5, h6, h7), p3 + p5 + p6 + p7
