"""Cells with 2x2x2 points whose metal has no strength left: viscous hourglass control, and release as torn metal."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells.common import FORCE, MOST_DAMPED, earlier
from burst_fenicsx.kernels.cells.full_quadrature_rows import (
    ELASTIC,
    FREQUENCY,
    GRADIENT,
    PLACE,
    PLASTIC,
    POWER,
    SMALLEST,
    SPEED,
    STABLE,
    STRENGTH,
    SUM,
    VISCOUS,
    VOLUME,
)
from burst_fenicsx.kernels.cells.hexahedron import PER_CELL, Modes, cell_gradient, load_gradient, squared_gradients
from burst_fenicsx.kernels.cells.torn_metal import BEFORE, NOW, WHOLE
from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function
from burst_fenicsx.kernels.state import Grid, SolidState
from burst_fenicsx.kernels.vectors.tensors import (
    add_outer,
    add_scaled,
    add_vector,
    apply,
    dot,
    load_vector,
    outer,
    scaled,
)

__all__ = ["damp_hourglass", "mark_torn_metal", "release_metal"]


@lane_function
def _modes(scratch: np.ndarray, row: int, lane: int) -> Modes:
    """The modes of which an eighth stands in 21 rows."""
    return (
        scaled(8.0, load_vector(scratch, row, lane)),
        scaled(8.0, load_vector(scratch, row + 3, lane)),
        scaled(8.0, load_vector(scratch, row + 6, lane)),
        scaled(8.0, load_vector(scratch, row + 9, lane)),
        scaled(8.0, load_vector(scratch, row + 12, lane)),
        scaled(8.0, load_vector(scratch, row + 15, lane)),
        scaled(8.0, load_vector(scratch, row + 18, lane)),
    )


@block_kernel
def damp_hourglass(
    block: int, step: float, next_dt: float, material: np.ndarray, grid: Grid, scratch: np.ndarray
) -> None:
    """Viscous hourglass control of cells without strength at any point, with the coefficient of one-point cells.

    Where only a pressure is left, the same in the whole cell, nothing else resists hourglass modes. See `move_cells`,
    `stiffen` and `force_modes` of the one-point cell; `next_dt` (s) is the next step.
    """
    shear = 0.5 * material[0] / (1.0 + material[1])
    stiff = 2.0 * shear * (1.0 - material[1]) / (1.0 - 2.0 * material[1])
    for lane in range(LANES):
        scratch[POWER * LANES + lane] = 0.0
        if not material[4] > 0.0 or scratch[STRENGTH * LANES + lane] > 0.0:
            continue
        place, v = _modes(scratch, PLACE, lane), _modes(scratch, SPEED, lane)
        middle = earlier(place, v, -0.5 * step)
        (p, q, s3, r, s5, s6), volume = cell_gradient(middle)
        rate = add_outer(add_outer(add_outer(outer(v[0], p), v[1], q), v[2], s3), v[3], r)
        rate = add_outer(add_outer(rate, v[4], s5), v[5], s6)
        back = -1.0 / volume
        q3, q5 = add_scaled(v[2], back, apply(rate, middle[2])), add_scaled(v[4], back, apply(rate, middle[4]))
        q6, q7 = add_scaled(v[5], back, apply(rate, middle[5])), add_scaled(v[6], back, apply(rate, middle[6]))
        gradient, inverse = load_gradient(scratch, GRADIENT, lane), PER_CELL / scratch[VOLUME * LANES + lane]
        (xx, yy, zz), _ = squared_gradients(gradient)
        x3, x5, x6, x7 = place[2], place[4], place[5], place[6]
        square = 10.0 + 40.0 * inverse**2 * (xx + yy + zz) * max(dot(x3, x3), dot(x5, x5), dot(x6, x6), dot(x7, x7))
        mass = grid.mass[block * LANES + lane]
        sound = np.sqrt(stiff * scratch[VOLUME * LANES + lane] / mass)
        damping = 0.25 * material[8] * mass * sound * scratch[FREQUENCY * LANES + lane]
        if next_dt > 0.0:
            damping = min(damping, MOST_DAMPED * mass / (8.0 * next_dt * square))
        scratch[POWER * LANES + lane] = damping * (dot(q3, q3) + dot(q5, q5) + dot(q6, q6) + dot(q7, q7))
        linear = add_outer(add_outer(add_outer(outer(q3, x3), q5, x5), q6, x6), q7, x7)
        p, q, s3, r, s5, s6 = gradient
        pull, push = 8.0 * damping * inverse, -8.0 * damping
        add_vector(scaled(pull, apply(linear, p)), scratch, SUM, lane)
        add_vector(scaled(pull, apply(linear, q)), scratch, SUM + 3, lane)
        add_vector(add_scaled(scaled(pull, apply(linear, s3)), push, q3), scratch, SUM + 6, lane)
        add_vector(scaled(pull, apply(linear, r)), scratch, SUM + 9, lane)
        add_vector(add_scaled(scaled(pull, apply(linear, s5)), push, q5), scratch, SUM + 12, lane)
        add_vector(add_scaled(scaled(pull, apply(linear, s6)), push, q6), scratch, SUM + 15, lane)
        add_vector(scaled(push, q7), scratch, SUM + 18, lane)


@block_kernel
def mark_torn_metal(block: int, material: np.ndarray, state: SolidState, scratch: np.ndarray) -> int:
    """Release cells without strength at any point of which a point has no volume left.

    Returns how many cells of the block are released, now or before.
    """
    slot, count = block * LANES, 0
    for lane in range(LANES):
        spent = material[4] > 0.0 and scratch[STRENGTH * LANES + lane] == 0.0
        if spent and state.released[slot + lane] == WHOLE and not scratch[SMALLEST * LANES + lane] > 0.0:
            state.released[slot + lane] = NOW
        count += 0 if state.released[slot + lane] == WHOLE else 1
    return count


@block_kernel
def release_metal(block: int, grid: Grid, state: SolidState, scratch: np.ndarray) -> None:
    """Take stress, forces and the bound on the step from released cells, which keep the volume that they had.

    What they held elastically goes to the plastic work.
    """
    for lane in range(LANES):
        slot = block * LANES + lane
        if state.released[slot] == WHOLE:
            continue
        energy = 0.125 * scratch[ELASTIC * LANES + lane] * grid.volume[slot]
        scratch[PLASTIC * LANES + lane] = energy if state.released[slot] == NOW else 0.0
        state.released[slot] = BEFORE
        scratch[VOLUME * LANES + lane] = scratch[SMALLEST * LANES + lane] = grid.volume[slot]
        scratch[VISCOUS * LANES + lane] = scratch[POWER * LANES + lane] = 0.0
        scratch[STABLE * LANES + lane] = np.inf
        for n in range(24):
            scratch[(FORCE + n) * LANES + lane] = 0.0
        if lane < grid.filled[block]:
            state.stress[grid.cells[block, lane]] = 0.0
