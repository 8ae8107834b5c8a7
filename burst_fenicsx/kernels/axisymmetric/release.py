"""Cells that are no continuum any more: torn metal and crushed products give up their forces; their mass flies on.

A cell is judged before its state advances, by the strength and the burn that it has until then, so that a shape out of
which no finite number can come reaches no state. A released cell keeps the volume that it had and is at rest as far as
its state goes; a cell with strength that turns inside out is not released and stops the run.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.axisymmetric.quadrilateral import (
    INITIAL_VOLUME,
    MIN_CORNER,
    RELEASED,
    ROWS_OF_CELLS,
    Rings,
)
from burst_fenicsx.kernels.cells import charge_pressure
from burst_fenicsx.kernels.cells import solid as solid_parts
from burst_fenicsx.kernels.cells.common import (
    COEFFICIENT_LIMIT,
    DAMPING,
    HOURGLASS,
    POSITION,
    RATE,
    STABLE,
    VISCOUS,
    VOLUME,
)
from burst_fenicsx.kernels.cells.torn_metal import BLOWN_UP, NOTHING_LEFT
from burst_fenicsx.kernels.lanes import LANES, block_kernel
from burst_fenicsx.kernels.state import Grid
from burst_fenicsx.kernels.vectors.tensors import load_symmetric, store_symmetric, store_vector

__all__ = [
    "drop_forces",
    "empty_charge",
    "hold_released",
    "mark_crushed_products",
    "mark_torn_metal",
    "release_metal",
]

_CRUSHED = 0.45  # volume of products over that of the charge below which nothing real can press them
_NOW, _BEFORE = 0.5, 1.0  # values of RELEASED: in this step, in an earlier one
_ZERO = (0.0, 0.0, 0.0)


@block_kernel
def mark_torn_metal(material: np.ndarray, scratch: np.ndarray) -> int:
    """Mark cells that have lost their strength and have folded while they were blown up, or have no volume left.

    Returns how many cells of the block are released, now or before.
    """
    count = 0
    for lane in range(LANES):
        tau, _ = solid_parts.strengths(material, scratch, lane)
        relative = scratch[VOLUME * LANES + lane] / scratch[INITIAL_VOLUME * LANES + lane]
        folded = not scratch[MIN_CORNER * LANES + lane] > 0.0
        torn = (folded and relative > BLOWN_UP) or not relative > NOTHING_LEFT
        if torn and material[2] > 0.0 and tau == 0.0 and scratch[RELEASED * LANES + lane] == 0.0:
            scratch[RELEASED * LANES + lane] = _NOW
        count += 1 if scratch[RELEASED * LANES + lane] > 0.0 else 0
    return count


@block_kernel
def mark_crushed_products(scratch: np.ndarray) -> int:
    """Mark cells of products that have hardly any volume left, pinched off between nodes.

    Returns how many cells of the block are released, now or before.
    """
    count = 0
    for lane in range(LANES):
        relative = scratch[VOLUME * LANES + lane] / scratch[INITIAL_VOLUME * LANES + lane]
        burnt = scratch[charge_pressure.BURN * LANES + lane] >= 1.0
        if burnt and not relative > _CRUSHED and scratch[RELEASED * LANES + lane] == 0.0:
            scratch[RELEASED * LANES + lane] = _NOW
        count += 1 if scratch[RELEASED * LANES + lane] > 0.0 else 0
    return count


@block_kernel
def hold_released(block: int, grid: Grid, scratch: np.ndarray, rings: Rings) -> None:
    """Leave released cells the volume that they had, and no motion, so that their state stays a number."""
    kept = rings.kept[block]
    for lane in range(LANES):
        if scratch[RELEASED * LANES + lane] > 0.0:
            kept[(ROWS_OF_CELLS - 1) * LANES + lane] = _BEFORE
            rings.released[grid.cells[block, lane]] = 1
            scratch[VOLUME * LANES + lane] = grid.volume[block * LANES + lane]
            for k in range(9):
                scratch[(RATE + k) * LANES + lane] = 0.0
            store_vector(_ZERO, scratch, HOURGLASS, lane)


@block_kernel
def release_metal(material: np.ndarray, scratch: np.ndarray) -> None:
    """Take stress and resistance from released cells; what they hold elastically goes to the plastic work."""
    for lane in range(LANES):
        if not scratch[RELEASED * LANES + lane] > 0.0:
            continue
        if scratch[RELEASED * LANES + lane] == _NOW:
            stress = load_symmetric(scratch, solid_parts.STRESS, lane)
            scratch[solid_parts.DISSIPATION * LANES + lane] += solid_parts.elastic_energy(stress, material)
        store_symmetric((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), scratch, solid_parts.STRESS, lane)
        store_vector(_ZERO, scratch, solid_parts.STORED, lane)
        scratch[solid_parts.SPRING * LANES + lane] = scratch[COEFFICIENT_LIMIT * LANES + lane] = 0.0
        _let_rest(scratch, lane)


@block_kernel
def empty_charge(scratch: np.ndarray) -> None:
    """Take pressure, viscosity and resistance from released cells of the charge."""
    for lane in range(LANES):
        if scratch[RELEASED * LANES + lane] > 0.0:
            scratch[charge_pressure.PRESSURE * LANES + lane] = 0.0
            store_symmetric((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), scratch, charge_pressure.STRESS, lane)
            _let_rest(scratch, lane)


@block_kernel
def _let_rest(scratch: np.ndarray, lane: int) -> None:
    """No viscosity, no damping, and no bound on the step."""
    scratch[VISCOUS * LANES + lane] = scratch[DAMPING * LANES + lane] = 0.0
    scratch[STABLE * LANES + lane] = np.inf


@block_kernel
def drop_forces(scratch: np.ndarray) -> None:
    """Set the nodal forces of released cells to zero, which their shape may have made NaN."""
    for lane in range(LANES):
        if scratch[RELEASED * LANES + lane] > 0.0:
            for n in range(8):
                scratch[(POSITION + n) * LANES + lane] = 0.0
