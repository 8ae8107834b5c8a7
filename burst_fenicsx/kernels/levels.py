"""Levels of cells and nodes: a cell of level l takes 2^l steps while the longest is taken once."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel

__all__ = ["node_levels", "raise_levels"]


@kernel
def node_levels(dofmap: np.ndarray, level: np.ndarray, finest: np.ndarray, coarsest: np.ndarray) -> None:
    """Highest and lowest level of the cells around each node, (nodes,) int8, overwritten.

    `dofmap` (cells, 8) int32; `level` (cells,) int8.
    """
    finest[:] = 0
    coarsest[:] = 127
    for cell in range(dofmap.shape[0]):
        for n in range(8):
            node = dofmap[cell, n]
            finest[node] = max(finest[node], level[cell])
            coarsest[node] = min(coarsest[node], level[cell])


@kernel
def raise_levels(dofmap: np.ndarray, finest: np.ndarray, level: np.ndarray) -> int:
    """Raise cells that lie more than one level below a neighbour; how many were raised.

    `dofmap` (cells, 8) int32; `finest` (nodes,) as from `node_levels`; `level` (cells,) int8, in place.
    """
    raised = 0
    for cell in range(dofmap.shape[0]):
        highest = 0
        for n in range(8):
            highest = max(highest, finest[dofmap[cell, n]])
        if level[cell] < highest - 1:
            level[cell] = highest - 1
            raised += 1
    return raised
