"""Levels of cells and nodes, a cell of level l taking 2^l steps while the longest is taken once; colours of groups."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, kernel

__all__ = ["blocks_are_mixed", "colour_groups", "move_lanes", "node_levels", "raise_levels"]

_BITS = 64


@kernel
def node_levels(dofmap: np.ndarray, level: np.ndarray, finest: np.ndarray, coarsest: np.ndarray) -> None:
    """Highest and lowest level of the cells around each node, (nodes,) int8, overwritten.

    `dofmap` (cells, corners) int32; `level` (cells,) int8, -1 of cells that take no steps.
    """
    finest[:] = -1
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


@kernel
def move_lanes(source: np.ndarray, blocks: np.ndarray, old: np.ndarray, new: np.ndarray) -> None:
    """Move rows of lanes, (blocks, rows LANES), to the given `blocks` (k,) of `new`.

    `source` (slots,) int32 is the old slot of each of the new ones.
    """
    rows = old.shape[1] // LANES
    for k in range(blocks.size):
        block = np.uint64(blocks[k])
        for lane in range(LANES):
            slot = np.uint64(source[block * LANES + lane])
            before, place = slot // np.uint64(LANES), slot % np.uint64(LANES)
            for row in range(rows):
                new[block, row * LANES + lane] = old[before, row * LANES + place]


@kernel
def colour_groups(
    order: np.ndarray, first: np.ndarray, dofmap: np.ndarray, taken: np.ndarray, colour: np.ndarray
) -> bool:
    """Give each group of cells, one after another, the lowest colour that none of its nodes has seen.

    Parameters
    ----------
    order : (cells,) cells, group after group. first : (groups + 1,) into `order`.
    dofmap : (cells, corners) nodes.
    taken : (nodes, words) uint64, zero: the colours that each node has seen, a bit each.
    colour : (groups,) int32, overwritten.

    Returns
    -------
    Whether the bits sufficed.
    """
    words = taken.shape[1]
    seen = np.empty(words, dtype=np.uint64)
    for group in range(first.size - 1):
        seen[:] = 0
        for k in range(first[group], first[group + 1]):
            for corner in range(dofmap.shape[1]):
                for word in range(words):
                    seen[word] |= taken[dofmap[order[k], corner], word]
        lowest = 0
        while lowest < _BITS * words and (seen[lowest // _BITS] >> np.uint64(lowest % _BITS)) & np.uint64(1):
            lowest += 1
        if lowest == _BITS * words:
            return False
        colour[group] = lowest
        for k in range(first[group], first[group + 1]):
            for corner in range(dofmap.shape[1]):
                taken[dofmap[order[k], corner], lowest // _BITS] |= np.uint64(1) << np.uint64(lowest % _BITS)
    return True
