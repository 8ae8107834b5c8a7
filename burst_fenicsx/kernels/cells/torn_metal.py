"""Torn metal: hexahedra of casing and fuze that are no continuum any more give up their forces; their mass flies on.

Such a cell has lost its strength and has then been blown up, folded or flattened by more than any metal can be. It
takes part in nothing but the motion of its nodes, which keep their mass and momentum and which contact still sees. A
cell with strength that turns inside out is not released and stops the run.
"""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.cells import solid as solid_parts
from burst_fenicsx.kernels.cells.common import (
    COEFFICIENT_LIMIT,
    DAMPING,
    FORCE,
    HOURGLASS,
    POWER,
    RATE,
    STABLE,
    VISCOUS,
    VOLUME,
)
from burst_fenicsx.kernels.geometry.shapes import min_corner_volume
from burst_fenicsx.kernels.lanes import LANES, block_kernel, parallel_kernel
from burst_fenicsx.kernels.state import Grid, SolidState
from burst_fenicsx.kernels.vectors.tensors import load_symmetric, store_symmetric, store_vector

__all__ = [
    "BEFORE",
    "BLOWN_UP",
    "NOTHING_LEFT",
    "NOW",
    "WHOLE",
    "are_torn",
    "drop_forces",
    "hold_released",
    "keep_still",
    "release_metal",
]

BLOWN_UP = 2.0
"""Volume over the initial one above which metal without strength is torn, a ring if it is folded: mostly void."""
NOTHING_LEFT = 0.1
"""Volume over the initial one below which it is: no pressure of this burst compresses metal so far."""
WHOLE, NOW, BEFORE = 0, 1, 2
"""Values of `SolidState.released`: a cell that is whole, that is released in this step, or in an earlier one."""

_ZERO = (0.0, 0.0, 0.0)


@parallel_kernel
def are_torn(
    cells: np.ndarray, position: np.ndarray, dofmap: np.ndarray, relative: np.ndarray, torn: np.ndarray
) -> None:
    """Judge `cells` (k,) without strength by their shapes: whether each is torn metal, into `torn` (k,).

    Parameters
    ----------
    position : (nodes, 3) m. dofmap : (cells, 8) in tensor-product order.
    relative : (k,) volume over the initial one.

    Notes
    -----
    A folded cell is torn metal unless it is compressed: as long as it is, it holds its neighbours apart.
    """
    for k in numba.prange(cells.size):
        value = relative[k]
        folded = value >= 1.0 and not min_corner_volume(position, dofmap[cells[k]]) > 0.0
        torn[k] = folded or value > BLOWN_UP or not value > NOTHING_LEFT


@block_kernel
def hold_released(block: int, grid: Grid, state: SolidState, material: np.ndarray, scratch: np.ndarray) -> int:
    """Leave released cells the volume that they had, and no motion, so that their state stays a number.

    A cell without strength that has no volume left is released here and now. Returns how many lanes are released.
    """
    slot, count = block * LANES, 0
    for lane in range(LANES):
        gone = state.released[slot + lane] != WHOLE
        if not gone and not scratch[VOLUME * LANES + lane] > 0.0 and material[4] > 0.0:
            tau, _ = solid_parts.strengths(material, scratch, lane)
            if tau == 0.0:
                state.released[slot + lane] = NOW
                gone = True
        if gone:
            count += 1
            keep_still(slot + lane, lane, grid, scratch)
    return count


@block_kernel
def keep_still(slot: int, lane: int, grid: Grid, scratch: np.ndarray) -> None:
    """Leave a released cell the volume that it had and give it no motion."""
    scratch[VOLUME * LANES + lane] = grid.volume[slot]
    for k in range(9):
        scratch[(RATE + k) * LANES + lane] = 0.0
    for k in range(4):
        store_vector(_ZERO, scratch, HOURGLASS + 3 * k, lane)


@block_kernel
def release_metal(block: int, state: SolidState, material: np.ndarray, scratch: np.ndarray) -> None:
    """Take stress and resistance from released cells; what they hold elastically goes to the plastic work."""
    slot = block * LANES
    for lane in range(LANES):
        if state.released[slot + lane] == WHOLE:
            continue
        if state.released[slot + lane] == NOW:
            stress = load_symmetric(scratch, solid_parts.STRESS, lane)
            scratch[solid_parts.DISSIPATION * LANES + lane] += solid_parts.elastic_energy(stress, material)
            state.released[slot + lane] = BEFORE
        store_symmetric((0.0, 0.0, 0.0, 0.0, 0.0, 0.0), scratch, solid_parts.STRESS, lane)
        for k in range(4):
            store_vector(_ZERO, scratch, solid_parts.STORED + 3 * k, lane)
            scratch[(COEFFICIENT_LIMIT + k) * LANES + lane] = 0.0
        scratch[solid_parts.SPRING * LANES + lane] = scratch[DAMPING * LANES + lane] = 0.0
        scratch[VISCOUS * LANES + lane] = 0.0
        scratch[STABLE * LANES + lane] = np.inf


@block_kernel
def drop_forces(block: int, released: np.ndarray, scratch: np.ndarray) -> None:
    """Set the nodal forces of released cells to zero, which their shape may have made NaN; `released` (slots,)."""
    for lane in range(LANES):
        if released[block * LANES + lane] != WHOLE:
            scratch[POWER * LANES + lane] = 0.0
            for n in range(24):
                scratch[(FORCE + n) * LANES + lane] = 0.0
