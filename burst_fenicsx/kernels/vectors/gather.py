"""Values of a block's cells and nodes copied to rows, a lane a cell, and nodal forces added back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, inlined_kernel
from burst_fenicsx.kernels.vectors.transposition import WIDTH, add_triples, load_triples

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
    level, corners = grid.level[block], grid.nodes.shape[1]
    position, velocity, mean, finest = nodes.position, nodes.velocity, nodes.mean, nodes.finest
    for n in range(corners):
        for lane in range(0, LANES, WIDTH):
            first, row = (block * corners + n) * LANES + lane, 3 * n * LANES + lane
            load_triples(position, position, finest, level, grid.nodes, first, positions, row)
            if grid.mixed[block]:
                load_triples(velocity, mean, finest, level, grid.nodes, first, velocities, row)
            else:
                load_triples(velocity, velocity, finest, level, grid.nodes, first, velocities, row)


@inlined_kernel
def add_nodal_forces(block: int, grid: Grid, rows: np.ndarray, force: np.ndarray) -> None:
    """Add the nodal forces in the rows, 3 n + i for node n, to `force` (nodes, 3) in N."""
    corners, filled = grid.nodes.shape[1], grid.filled[block]
    for n in range(corners):
        for lane in range(0, filled - WIDTH + 1, WIDTH):
            add_triples(rows, 3 * n * LANES + lane, grid.nodes, (block * corners + n) * LANES + lane, force)
        for lane in range(filled // WIDTH * WIDTH, filled):
            node = np.uint64(grid.nodes[block, n, lane])
            for i in range(3):
                force[node, i] += rows[(3 * n + i) * LANES + lane]
