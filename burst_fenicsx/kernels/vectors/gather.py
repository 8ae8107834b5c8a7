"""Values of a block's cells and nodes copied to rows, a lane a cell, and nodal forces added back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, inlined_kernel

if TYPE_CHECKING:
    from burst_fenicsx.kernels.state import Grid, Nodes


@inlined_kernel
def load_slots(block: int, values: np.ndarray, rows: np.ndarray) -> None:
    """Copy a block's `values` (slots,) to a row."""
    start = np.uint64(block) * np.uint64(LANES)  # unsigned: no code for negative ones
    for lane in range(LANES):
        rows[lane] = values[start + np.uint64(lane)]


@inlined_kernel
def store_slots(block: int, rows: np.ndarray, values: np.ndarray) -> None:
    """Copy a row back to a block's `values` (slots,)."""
    start = np.uint64(block) * np.uint64(LANES)
    for lane in range(LANES):
        values[start + np.uint64(lane)] = rows[lane]


@inlined_kernel
def gather_nodes(block: int, nodes: Nodes, grid: Grid, positions: np.ndarray, velocities: np.ndarray) -> None:
    """Copy a block's nodal positions and velocities to rows, 3 n + i for node n.

    Velocities are means over the cells' step where nodes take shorter ones.
    """
    level = grid.level[block]
    for lane in range(LANES):
        cell = np.uint64(grid.cells[block, lane])
        for n in range(grid.dofmap.shape[1]):
            node = np.uint64(grid.dofmap[cell, n])
            for i in range(3):
                positions[(3 * n + i) * LANES + lane] = nodes.position[node, i]
            if nodes.finest[node] > level:
                for i in range(3):
                    velocities[(3 * n + i) * LANES + lane] = nodes.mean[node, i]
            else:
                for i in range(3):
                    velocities[(3 * n + i) * LANES + lane] = nodes.velocity[node, i]


@inlined_kernel
def add_nodal_forces(block: int, grid: Grid, rows: np.ndarray, force: np.ndarray) -> None:
    """Add the nodal forces in the rows, 3 n + i for node n, to `force` (nodes, 3) in N."""
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        for n in range(grid.dofmap.shape[1]):
            node = np.uint64(grid.dofmap[cell, n])
            for i in range(3):
                force[node, i] += rows[(3 * n + i) * LANES + lane]
