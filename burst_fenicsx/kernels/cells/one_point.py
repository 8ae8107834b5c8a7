"""Motion and nodal forces of the one-point hexahedron with its mean gradient (Flanagan and Belytschko 1981)."""

from __future__ import annotations

from typing import Any

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
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
    store_nodal_forces,
)
from burst_fenicsx.kernels.cells.hourglass import Forces
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.state import Grid, Nodes
from burst_fenicsx.kernels.vectors.nodal_values import add_nodal_forces, gather_means
from burst_fenicsx.kernels.vectors.nodal_values import gather as gather_nodes
from burst_fenicsx.kernels.vectors.tensors import (
    Matrix,
    Symmetric,
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
    "add_forces",
    "force_modes",
    "gather",
    "move",
    "store_forces",
]


@block_kernel
def gather(block: int, nodes: Nodes, grid: Grid, element: Any, scratch: np.ndarray) -> None:  # noqa: ANN401, ARG001
    """Gather positions and velocities of a block's nodes, mean ones over the cells' step, and the cells' masses."""
    cells, rows = grid.cells[block], scratch[at.VELOCITY * LANES :]
    gather_nodes(cells, grid.dofmap, nodes.position, scratch[at.POSITION * LANES :])
    if grid.mixed[block]:
        gather_means(cells, grid.dofmap, grid.level[block], nodes.finest, nodes.velocity, nodes.mean, rows)
    else:
        gather_nodes(cells, grid.dofmap, nodes.velocity, rows)
    for lane in range(LANES):
        scratch[at.MASS * LANES + lane] = grid.mass[block * LANES + lane]


@block_kernel
def move(step: float, scratch: np.ndarray) -> None:
    """From nodal places and velocities to what describes the cells' motion in the step (s) and their shape after it.

    The velocity gradient is the mean one on the mid-step configuration. The hourglass rates are
    q_ia = sum over nodes of gamma_a v_i (Flanagan and Belytschko 1981, Eq. 43-51): gamma is the mode less its linear
    part, so that rigid motion and uniform strain excite none. The length L, c dt <= L, is 2 c over the highest
    frequency, see `squared_gradients`.
    """
    widest_vectors()
    for lane in range(LANES):
        # Places first, then one component of the velocity after the other: all modes at once fill the registers twice.
        middle = cell_modes_earlier(scratch, at.POSITION, at.VELOCITY, -0.5 * step, lane)
        gradient, volume = cell_gradient(middle)
        inverse = 1.0 / volume
        _move_component(0, middle, gradient, inverse, scratch, lane)
        _move_component(1, middle, gradient, inverse, scratch, lane)
        _move_component(2, middle, gradient, inverse, scratch, lane)
        xx, yy = scratch[at.RATE * LANES + lane], scratch[(at.RATE + 4) * LANES + lane]
        scratch[at.DILATATION * LANES + lane] = xx + yy + scratch[(at.RATE + 8) * LANES + lane]
        place = cell_modes(scratch, at.POSITION, lane)
        gradient, volume = cell_gradient(place)
        store_gradient(gradient, scratch, at.GRADIENT, lane)
        store_vector(place[2], scratch, at.HOURGLASS_MODES, lane)
        store_vector(place[4], scratch, at.HOURGLASS_MODES + 3, lane)
        store_vector(place[5], scratch, at.HOURGLASS_MODES + 6, lane)
        store_vector(place[6], scratch, at.HOURGLASS_MODES + 9, lane)
        (xx, yy, zz), largest = squared_gradients(gradient)
        inverse = 1.0 / volume
        scratch[at.VOLUME * LANES + lane] = PER_CELL * volume
        scratch[at.FREQUENCY * LANES + lane] = inverse * np.sqrt(16.0 * largest)
        square = 8.0 * inverse * inverse
        store_vector((square * xx, square * yy, square * zz), scratch, at.GRADIENT_SQUARES, lane)


@lane_function
def _move_component(i: int, middle: Modes, gradient: Gradient, inverse: float, scratch: np.ndarray, lane: int) -> None:
    """Row i of the mean velocity gradient L_ij = sum of v_ai b_aj / V, and that component of the hourglass rates.

    `middle` are the modes of the positions half a step ago, `gradient` and `inverse` what `cell_gradient` makes of
    them, the volume inverted.
    """
    v1, v2, v3, v4, v5, v6, v7 = component_modes(scratch, at.VELOCITY + i, lane)
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
def force_modes(
    stress: Symmetric,
    resistance: Forces,
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
    linear = outer(h3, load_vector(scratch, at.HOURGLASS_MODES, lane))
    linear = add_outer(linear, h5, load_vector(scratch, at.HOURGLASS_MODES + 3, lane))
    linear = add_outer(linear, h6, load_vector(scratch, at.HOURGLASS_MODES + 6, lane))
    linear = add_outer(linear, h7, load_vector(scratch, at.HOURGLASS_MODES + 9, lane))
    xx, yy, zz, xy, yz, zx = stress
    pull = _opposed(linear, PER_CELL / scratch[at.VOLUME * LANES + lane], ((xx, xy, zx), (xy, yy, yz), (zx, yz, zz)))
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


@lane_function
def _opposed(matrix: Matrix, factor: float, stress: Matrix) -> Matrix:
    """Matrix k M - sigma, sigma for `cell_gradient`'s gradient."""
    x, y, z = stress
    return (
        add_scaled(scaled(-PER_CELL, x), factor, matrix[0]),
        add_scaled(scaled(-PER_CELL, y), factor, matrix[1]),
        add_scaled(scaled(-PER_CELL, z), factor, matrix[2]),
    )


@lane_function
def store_forces(
    stress: Symmetric, resistance: Forces, share: float, rounding: float, scratch: np.ndarray, lane: int
) -> None:
    """Put the nodal forces (N) of a stress (Pa) and of hourglass forces (N), times `share`, in place of the positions.

    `rounding` is the constant of `exact.quantise`.
    """
    store_nodal_forces(force_modes(stress, resistance, scratch, lane), share, rounding, scratch, at.FORCE, lane)


@block_kernel
def add_forces(count: int, cells: np.ndarray, dofmap: np.ndarray, scratch: np.ndarray, force: np.ndarray) -> None:
    """Add the nodal forces of the first `count` cells of a block to `force` (nodes, 3) in N."""
    add_nodal_forces(count, cells, dofmap, scratch[at.FORCE * LANES :], force)
