"""Element erosion: cells that are no continuum any more give up their forces; their mass flies on.

Metal is eroded when it has lost its strength and has then folded while it was expanded (`mechanics.erosion`), or has
been flattened by more than any metal can be; products when they have hardly any volume left, pinched off between nodes.
An eroded cell takes part in nothing but the motion of its nodes, which keep their mass and momentum and which contact
still sees. Its state keeps the volume that it had and no motion, so that it stays a number. A cell with strength that
turns inside out is not eroded and stops the run.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.lanes import LANES, block_kernel, inlined_kernel
from burst_fenicsx.kernels.state import Grid

WHOLE, NOW, BEFORE = 0, 1, 2
"""Values of `SolidState.eroded`: a cell that is whole, that is eroded in this step, or in an earlier one."""


@inlined_kernel
def freeze_cells(block: int, grid: Grid, eroded: np.ndarray, scratch: np.ndarray) -> None:
    """Leave eroded cells the volume that they had and give them no motion."""
    for lane in range(LANES):
        slot = block * LANES + lane
        if eroded[slot] != WHOLE:
            scratch[at.VOLUME * LANES + lane] = scratch[at.MIN_VOLUME * LANES + lane] = grid.volume[slot]
            scratch[at.DILATATION * LANES + lane] = 0.0
            for k in range(9):
                scratch[(at.RATE + k) * LANES + lane] = 0.0
            for k in range(12):
                scratch[(at.HOURGLASS_RATE + k) * LANES + lane] = 0.0


@block_kernel
def clear_lane(scratch: np.ndarray, lane: int) -> None:
    """Take stress, viscosity, hourglass control and the bound on the step from an eroded cell."""
    for k in range(6):
        scratch[(at.STRESS + k) * LANES + lane] = 0.0
    scratch[at.PRESSURE * LANES + lane] = 0.0
    for k in range(4):
        scratch[(at.COEFFICIENT_LIMIT + k) * LANES + lane] = 0.0
    scratch[at.VISCOUS * LANES + lane] = scratch[at.DAMPING * LANES + lane] = 0.0
    scratch[at.STABLE * LANES + lane] = np.inf


@block_kernel
def drop_forces(block: int, eroded: np.ndarray, scratch: np.ndarray) -> None:
    """Set the nodal forces of eroded cells to zero, which their shape may have made NaN; `eroded` (slots,)."""
    for lane in range(LANES):
        if eroded[block * LANES + lane] != WHOLE:
            scratch[at.HOURGLASS_POWER * LANES + lane] = 0.0
            for n in range(24):
                scratch[(at.FORCE + n) * LANES + lane] = 0.0
