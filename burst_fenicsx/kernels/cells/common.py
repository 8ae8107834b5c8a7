"""What solid and charge cells share: how a block moves, viscosity and stable step, hourglass control, forces.

The rows of the scratch that are named here hold what one loop over the lanes leaves to the next one; since all rows lie
at constant distances, the compiler sees that they do not overlap.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells.hexahedron import (
    PER_CELL,
    Gradient,
    Modes,
    cell_gradient,
    cell_modes,
    cell_modes_earlier,
    component_modes,
    load_gradient,
    squared_gradients,
    store_gradient,
)
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import Grid, Nodes
from burst_fenicsx.kernels.vectors.nodal_values import gather, gather_means
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    Symmetric,
    Vector,
    add_outer,
    add_scaled,
    apply,
    dot,
    load_vector,
    outer,
    scaled,
    store_vector,
    subtract_from_product,
)

__all__ = [
    "COEFFICIENT_LIMIT",
    "DAMPING",
    "FORCE",
    "FREE",
    "FREQUENCY",
    "GRADIENT",
    "HOURGLASS",
    "MASS",
    "MOST_DAMPED",
    "POSITION",
    "POWER",
    "RATE",
    "STABLE",
    "VELOCITY",
    "VISCOUS",
    "VOLUME",
    "bound_hourglass",
    "earlier",
    "force_modes",
    "gather_velocities",
    "lower_limits",
    "may_overdo",
    "move_cells",
    "trace_of_rate",
    "viscosity_and_step",
]

POSITION, VELOCITY = 0, 24  # nodal values, m and m/s
FORCE = 0  # nodal values, N; in the place of the positions
GRADIENT = 48  # of `cell_gradient`, 18 rows, m2
HOURGLASS_MODES = 66  # hourglass modes 3, 5, 6, 7 of the positions, 12 rows, m
RATE = 78  # velocity gradient, 9 rows, 1/s
HOURGLASS = 87  # hourglass rates of the modes 3, 5, 6, 7, 12 rows, m/s
VOLUME = 99  # m3
FREQUENCY = 100  # inverse of the length that governs the stable step, 1/m
GRADIENT_SQUARES = 101  # squares of the norms of the mean gradient over the nodes over the volume, 3 rows, 1/m2
MASS = 104  # kg
VISCOUS, STABLE = 105, 106  # artificial viscous pressure, Pa; stable step, s
DAMPING = 107  # viscous hourglass coefficient, N s/m
COEFFICIENT_LIMIT = 108  # upper limit of it for each of the modes 3, 5, 6, 7, 4 rows, N s/m
POWER = 112  # of the hourglass forces, W
FREE = VELOCITY  # first of 24 rows for the material's own, free once the cells have moved: fewer rows stay in the cache

MOST_DAMPED = 1.0
"""Share of an hourglass rate that viscosity may take away in one step; beyond it the rate would change its sign."""

_ROOT_8 = np.sqrt(8.0)


@block_kernel
def gather_velocities(block: int, nodes: Nodes, grid: Grid, rows: np.ndarray) -> None:
    """Gather the nodes' mean velocities (m/s) over the step of the block's cells; `rows` as for `gather`."""
    if grid.mixed[block]:
        gather_means(grid.cells[block], grid.dofmap, grid.level[block], nodes.finest, nodes.velocity, nodes.mean, rows)
    else:
        gather(grid.cells[block], grid.dofmap, nodes.velocity, rows)


@block_kernel
def move_cells(step: float, scratch: np.ndarray) -> None:
    """From nodal places and velocities to what describes the cells' motion in the step (s) and their shape after it.

    The velocity gradient is the mean one on the mid-step configuration. The hourglass rates are
    q_ia = sum over nodes of gamma_a v_i (Flanagan and Belytschko 1981, Eq. 43-51): gamma is the mode less its linear
    part, so that rigid motion and uniform strain excite none. The length L, c dt <= L, is 2 c over the highest
    frequency, see `squared_gradients`.
    """
    widest_vectors()
    for lane in range(LANES):
        # Places first, then one component of the velocity after the other: all modes at once fill the registers twice.
        middle = cell_modes_earlier(scratch, POSITION, VELOCITY, -0.5 * step, lane)
        gradient, volume = cell_gradient(middle)
        inverse = 1.0 / volume
        _move_component(0, middle, gradient, inverse, scratch, lane)
        _move_component(1, middle, gradient, inverse, scratch, lane)
        _move_component(2, middle, gradient, inverse, scratch, lane)
        place = cell_modes(scratch, POSITION, lane)
        gradient, volume = cell_gradient(place)
        store_gradient(gradient, scratch, GRADIENT, lane)
        store_vector(place[2], scratch, HOURGLASS_MODES, lane)
        store_vector(place[4], scratch, HOURGLASS_MODES + 3, lane)
        store_vector(place[5], scratch, HOURGLASS_MODES + 6, lane)
        store_vector(place[6], scratch, HOURGLASS_MODES + 9, lane)
        (xx, yy, zz), largest = squared_gradients(gradient)
        inverse = 1.0 / volume
        scratch[VOLUME * LANES + lane] = PER_CELL * volume
        scratch[FREQUENCY * LANES + lane] = inverse * np.sqrt(16.0 * largest)
        square = 8.0 * inverse * inverse
        store_vector((square * xx, square * yy, square * zz), scratch, GRADIENT_SQUARES, lane)


@lane_function
def _move_component(i: int, middle: Modes, gradient: Gradient, inverse: float, scratch: np.ndarray, lane: int) -> None:
    """Row i of the mean velocity gradient L_ij = sum of v_ai b_aj / V, and that component of the hourglass rates.

    `middle` are the modes of the positions half a step ago, `gradient` and `inverse` what `cell_gradient` makes of
    them, the volume inverted.
    """
    v1, v2, v3, v4, v5, v6, v7 = component_modes(scratch, VELOCITY + i, lane)
    row = scaled(v1, gradient[0])
    row = add_scaled(row, v2, gradient[1])
    row = add_scaled(row, v3, gradient[2])
    row = add_scaled(row, v4, gradient[3])
    row = add_scaled(row, v5, gradient[4])
    row = scaled(inverse, add_scaled(row, v6, gradient[5]))
    store_vector(row, scratch, RATE + 3 * i, lane)
    scratch[(HOURGLASS + i) * LANES + lane] = v3 - dot(row, middle[2])
    scratch[(HOURGLASS + 3 + i) * LANES + lane] = v5 - dot(row, middle[4])
    scratch[(HOURGLASS + 6 + i) * LANES + lane] = v6 - dot(row, middle[5])
    scratch[(HOURGLASS + 9 + i) * LANES + lane] = v7 - dot(row, middle[6])


@lane_function
def earlier(place: Modes, velocity: Modes, back: float) -> Modes:
    """Modes of the places (m) at the time `back` (s, negative) from now, uniform motion taken back."""
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
    length: float,
    density: float,
    sound: float,
    fastest: float,
    linear: float,
    quadratic: float,
) -> tuple[float, float]:
    """Artificial viscous pressure q (Pa) in compression and the stable step (s) with it.

    q = rho L |D| (q1 c + q2 L |D|), D the rate of volume (von Neumann and Richtmyer 1950, Landshoff 1955).
    The damped mode of frequency omega = 2 c/L with the ratio zeta = q1 + q2 L |D| / c of the critical
    damping allows dt <= (2/omega) (sqrt(1 + zeta^2) - zeta) (Belytschko et al. 2000, section 6.2).
    `fastest` is the sound speed that the step must allow for.
    """
    closing = length * max(-dilatation, 0.0)
    speed = quadratic * closing
    damped = linear * fastest + speed if dilatation < 0.0 else 0.0
    viscous = density * closing * (linear * sound + speed)
    return viscous, length / (np.sqrt(fastest * fastest + damped * damped) + damped)


@lane_function
def trace_of_rate(scratch: np.ndarray, lane: int) -> float:
    """Rate of volume over the volume (1/s)."""
    return scratch[RATE * LANES + lane] + scratch[(RATE + 4) * LANES + lane] + scratch[(RATE + 8) * LANES + lane]


@lane_function
def _hourglass_square(mode: Vector, gradient_norm: Vector) -> float:
    """Bound on the square of an hourglass vector, |gamma| <= sqrt(8) + sum over i of |h x_i| |b_i| / V.

    8 in a brick; large where a cell is warped by more than it is thick. `mode` is that of the positions (m).
    """
    size = _ROOT_8 + abs(mode[0]) * gradient_norm[0] + abs(mode[1]) * gradient_norm[1] + abs(mode[2]) * gradient_norm[2]
    return size * size


@lane_function
def may_overdo(coefficient: float, coefficient_limit: float, scratch: np.ndarray, lane: int) -> bool:
    """Whether an hourglass coefficient may exceed its limit; `coefficient_limit` is that of vectors of square one.

    Without roots: (sqrt(8) + x)^2 <= 10 + 5 x^2, and x^2 is at most |h x|^2 times the sum of |b_i|^2 / V^2.
    A little more allows for rounding: a cell's forces must not depend on whether others of its block need the bound.
    """
    h3, h5 = load_vector(scratch, HOURGLASS_MODES, lane), load_vector(scratch, HOURGLASS_MODES + 3, lane)
    h6, h7 = load_vector(scratch, HOURGLASS_MODES + 6, lane), load_vector(scratch, HOURGLASS_MODES + 9, lane)
    mode_square = max(dot(h3, h3), dot(h5, h5), dot(h6, h6), dot(h7, h7))
    sx, sy, sz = load_vector(scratch, GRADIENT_SQUARES, lane)
    return coefficient * (10.01 + 5.01 * mode_square * (sx + sy + sz)) > coefficient_limit


@block_kernel
def bound_hourglass(step: float, needed: bool, scratch: np.ndarray) -> None:
    """Find the hourglass coefficients that the step (s) lets each cell bear: where none is `needed`, without limit."""
    widest_vectors()
    if not needed:
        for k in range(4 * LANES):
            scratch[COEFFICIENT_LIMIT * LANES + k] = np.inf
        return
    for lane in range(LANES):
        sx, sy, sz = load_vector(scratch, GRADIENT_SQUARES, lane)
        gradient_norm = (np.sqrt(sx), np.sqrt(sy), np.sqrt(sz))
        coefficient_limit = scratch[MASS * LANES + lane] / (8.0 * step)
        for a in range(4):
            square = _hourglass_square(load_vector(scratch, HOURGLASS_MODES + 3 * a, lane), gradient_norm)
            scratch[(COEFFICIENT_LIMIT + a) * LANES + lane] = coefficient_limit / square


@lane_function
def lower_limits(cell: int, stable: float, volume: float, share: float, limits: np.ndarray) -> None:
    """Take a cell's stable step over `share` (s) and its volume (m3) into the smallest of `limits`."""
    if stable < share * limits[0]:
        limits[0] = stable / share
    if not volume >= limits[1]:
        # Not a number must not be overwritten by the next cell.
        limits[1] = volume if volume == volume else -np.inf
        limits[2] = cell


@lane_function
def force_modes(
    stress: Symmetric,
    resistance: tuple[Vector, Vector, Vector, Vector],
    scratch: np.ndarray,
    lane: int,
) -> Modes:
    """Modes of the nodal forces (N), f_a = -sigma b_a - Q gamma_a.

    Parameters
    ----------
    stress : sigma with the viscous pressure taken off (Pa).
    resistance : generalised hourglass forces Q of the modes 3, 5, 6, 7 (N).
    scratch : the rows `HOURGLASS_MODES`, `GRADIENT` and `VOLUME` are read.
    """
    h3, h5, h6, h7 = resistance
    # The linear part of gamma acts like a stress, which need not be symmetric.
    linear = outer(h3, load_vector(scratch, HOURGLASS_MODES, lane))
    linear = add_outer(linear, h5, load_vector(scratch, HOURGLASS_MODES + 3, lane))
    linear = add_outer(linear, h6, load_vector(scratch, HOURGLASS_MODES + 6, lane))
    linear = add_outer(linear, h7, load_vector(scratch, HOURGLASS_MODES + 9, lane))
    xx, yy, zz, xy, yz, zx = stress
    pull = _opposed(linear, PER_CELL / scratch[VOLUME * LANES + lane], ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz)))
    p, q, s3, r, s5, s6 = load_gradient(scratch, GRADIENT, lane)
    return (
        apply(pull, p),
        apply(pull, q),
        subtract_from_product(pull, s3, h3),
        apply(pull, r),
        subtract_from_product(pull, s5, h5),
        subtract_from_product(pull, s6, h6),
        scaled(-1.0, h7),
    )


@lane_function
def _opposed(matrix: Matrix, factor: float, stress: Matrix) -> Matrix:
    """Matrix k M - sigma, sigma for `cell_gradient`'s gradient."""
    x, y, z = stress
    return (
        add_scaled(scaled(-PER_CELL, x), factor, matrix[0]),
        add_scaled(scaled(-PER_CELL, y), factor, matrix[1]),
        add_scaled(scaled(-PER_CELL, z), factor, matrix[2]),
    )
