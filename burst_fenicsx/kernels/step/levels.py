"""Levels of cells and nodes: a cell of level l takes 2^l steps while the longest is taken once."""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.lanes import LANES, kernel, parallel_kernel

__all__ = ["blocks_are_mixed", "move_lanes", "node_levels", "raise_levels"]


@kernel
def node_levels(dofmap: np.ndarray, level: np.ndarray, finest: np.ndarray, coarsest: np.ndarray) -> None:
    """Highest and lowest level of the cells around each node, (nodes,) int8, overwritten.

    `dofmap` (cells, corners) int32; `level` (cells,) int8.
    """
    finest[:] = 0
    coarsest[:] = 127
    for cell in range(dofmap.shape[0]):
        for n in range(dofmap.shape[1]):
            node = dofmap[cell, n]
            finest[node] = max(finest[node], level[cell])
            coarsest[node] = min(coarsest[node], level[cell])


@kernel
def raise_levels(dofmap: np.ndarray, finest: np.ndarray, level: np.ndarray) -> int:
    """Raise cells that lie more than one level below a neighbour; how many were raised.

    `dofmap` (cells, corners) int32; `finest` (nodes,) as from `node_levels`; `level` (cells,) int8, in place.
    """
    raised = 0
    for cell in range(dofmap.shape[0]):
        highest = 0
        for n in range(dofmap.shape[1]):
            highest = max(highest, finest[dofmap[cell, n]])
        if level[cell] < highest - 1:
            level[cell] = highest - 1
            raised += 1
    return raised


@kernel
def blocks_are_mixed(
    cells: np.ndarray, level: np.ndarray, dofmap: np.ndarray, finest: np.ndarray, mixed: np.ndarray
) -> None:
    """Return for each block whether a node of its cells takes shorter steps than they do, `mixed` (blocks,) int8.

    `cells` (blocks, LANES) int32; `level` (blocks,); `dofmap` (cells, corners) int32; `finest` (nodes,) as in `Nodes`.
    """
    for block in range(cells.shape[0]):
        highest = 0
        for lane in range(LANES):
            for n in range(dofmap.shape[1]):
                highest = max(highest, finest[dofmap[cells[block, lane], n]])
        mixed[block] = highest > level[block]


@parallel_kernel
def move_lanes(source: np.ndarray, blocks: np.ndarray, old: np.ndarray, new: np.ndarray) -> None:
    """Move rows of lanes, (blocks, rows LANES), to the given `blocks` (k,) of `new`.

    `source` (slots,) int32 is the old slot of each of the new ones.
    """
    rows = old.shape[1] // LANES
    for k in numba.prange(blocks.size):
        block = np.uint64(blocks[k])
        for lane in range(LANES):
            slot = np.uint64(source[block * LANES + lane])
            before, place = slot // np.uint64(LANES), slot % np.uint64(LANES)
            for row in range(rows):
                new[block, row * LANES + lane] = old[before, row * LANES + place]
