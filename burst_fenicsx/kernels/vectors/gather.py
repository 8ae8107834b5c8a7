"""Values of a block's cells and nodes copied to rows, a lane a cell, and nodal forces added back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, block_kernel

if TYPE_CHECKING:
    from burst_fenicsx.kernels.state import Grid, Nodes


@block_kernel
def load_slots(block: int, values: np.ndarray, rows: np.ndarray, row: int) -> None:
    """Copy a block's `values` (slots,) to a row."""
    for lane in range(LANES):
        rows[row * LANES + lane] = values[block * LANES + lane]


@block_kernel
def store_slots(block: int, rows: np.ndarray, row: int, values: np.ndarray) -> None:
    """Copy a row back to a block's `values` (slots,)."""
    for lane in range(LANES):
        values[block * LANES + lane] = rows[row * LANES + lane]


@block_kernel
def gather_nodes(block: int, nodes: Nodes, grid: Grid, rows: np.ndarray, positions: int, velocities: int) -> None:
    """Copy a block's nodal positions and velocities, 3 n + i for node n, to the rows from the given ones on.

    Velocities are means over the cells' step where nodes take shorter ones.
    """
    level = grid.level[block]
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        for n in range(grid.dofmap.shape[1]):
            node = np.uint64(grid.dofmap[cell, n])
            for i in range(3):
                rows[(positions + 3 * n + i) * LANES + lane] = nodes.position[node, i]
            if nodes.finest[node] > level:
                for i in range(3):
                    rows[(velocities + 3 * n + i) * LANES + lane] = nodes.mean[node, i]
            else:
                for i in range(3):
                    rows[(velocities + 3 * n + i) * LANES + lane] = nodes.velocity[node, i]


@block_kernel
def add_nodal_forces(block: int, grid: Grid, rows: np.ndarray, row: int, force: np.ndarray) -> None:
    """Add the nodal forces in the rows from `row` on, 3 n + i for node n, to `force` (nodes, 3) in N."""
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        for n in range(grid.dofmap.shape[1]):
            node = np.uint64(grid.dofmap[cell, n])
            for i in range(3):
                force[node, i] += rows[(row + 3 * n + i) * LANES + lane]
