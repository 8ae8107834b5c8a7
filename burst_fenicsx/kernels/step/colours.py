"""Greedy colouring of groups of cells."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel

__all__ = ["colour_groups"]

_BITS = 64


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
