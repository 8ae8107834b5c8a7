"""Values of a block's cells and nodes copied to rows, a lane a cell, and nodal forces added back."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function
from burst_fenicsx.kernels.vectors.transposition import address, prefetch

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


@lane_function
def ask(values: np.ndarray, row: int) -> None:
    """Ask for the first numbers of a row of `values` (n, ...), which come into the cache meanwhile."""
    size = np.uint64(8 * (values.size // values.shape[0]))
    prefetch(address(values) + size * np.uint64(row))


@block_kernel
def ask_for_nodes(block: int, nodes: Nodes, grid: Grid) -> None:
    """Ask for the nodes of a block, of every third cell at four corners, and what it keeps by slot."""
    for lane in range(0, LANES, 3):
        cell = np.uint64(grid.cells[block, lane])
        for n in range(grid.dofmap.shape[1]):
            if n % 4 == 0 or n % 4 == 3:
                node = grid.dofmap[cell, n]
                ask(nodes.position, node)
                ask(nodes.velocity, node)
                ask(nodes.force, node)
    for first in range(0, LANES, 8):
        ask(grid.mass, block * LANES + first)
        ask(grid.volume, block * LANES + first)
        ask(grid.viscous, block * LANES + first)
        ask(grid.stable, block * LANES + first)


@block_kernel
def ask_for_dofs(block: int, grid: Grid) -> None:
    """Ask for the numbers of a block's nodes, of two cells a line."""
    size = np.uint64(4 * grid.dofmap.shape[1])
    for lane in range(0, LANES, 2):
        prefetch(address(grid.dofmap) + size * np.uint64(grid.cells[block, lane]))


@block_kernel
def add_nodal_forces(block: int, grid: Grid, rows: np.ndarray, row: int, force: np.ndarray) -> None:
    """Add the nodal forces in the rows from `row` on, 3 n + i for node n, to `force` (nodes, 3) in N."""
    for lane in range(grid.filled[block]):
        cell = np.uint64(grid.cells[block, lane])
        for n in range(grid.dofmap.shape[1]):
            node = np.uint64(grid.dofmap[cell, n])
            for i in range(3):
                force[node, i] += rows[(row + 3 * n + i) * LANES + lane]
