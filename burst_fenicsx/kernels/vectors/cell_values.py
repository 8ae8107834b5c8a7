"""What a block's cells keep: which they are, their numbers slot by slot copied to rows and back, their nodes' numbers.

A block's are asked for by `prefetch` while the one before it computes: else every block would wait for memory.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function
from burst_fenicsx.kernels.vectors.transposition import (
    WIDTH,
    address,
    copy_run,
    prefetch,
)

__all__ = ["Cells", "cells_of_lanes", "load_slots", "prefetch_dofs", "prefetch_slots", "store_slots"]

Cells: TypeAlias = tuple[np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64, np.uint64]

_BYTES = np.uint64(8)  # of a number


@lane_function
def cells_of_lanes(cells: np.ndarray, first: int) -> Cells:
    """`WIDTH` cells of a block from lane `first` on; unsigned, so that no code counts negative ones from the end."""
    return (
        np.uint64(cells[first]),
        np.uint64(cells[first + 1]),
        np.uint64(cells[first + 2]),
        np.uint64(cells[first + 3]),
        np.uint64(cells[first + 4]),
        np.uint64(cells[first + 5]),
        np.uint64(cells[first + 6]),
        np.uint64(cells[first + 7]),
    )


@lane_function
def _place(values: np.ndarray, k: int) -> np.uint64:
    """Address of number k."""
    return address(values) + _BYTES * np.uint64(k)


@block_kernel
def load_slots(block: int, values: np.ndarray, rows: np.ndarray, row: int) -> None:
    """Copy a block's `values` (slots,) to a row."""
    for first in range(0, LANES, WIDTH):
        copy_run(_place(values, block * LANES + first), _place(rows, row * LANES + first))


@block_kernel
def store_slots(block: int, rows: np.ndarray, row: int, values: np.ndarray) -> None:
    """Copy a row back to a block's `values` (slots,)."""
    for first in range(0, LANES, WIDTH):
        copy_run(_place(rows, row * LANES + first), _place(values, block * LANES + first))


@lane_function
def prefetch_slots(block: int, values: np.ndarray) -> None:
    """Bring a block's `values` (slots,) near."""
    for first in range(0, LANES, WIDTH):
        prefetch(_place(values, block * LANES + first))


@block_kernel
def prefetch_dofs(cells: np.ndarray, dofmap: np.ndarray) -> None:
    """Bring the rows of `dofmap` (all cells, corners) int32 of a block near, two of which fill a line."""
    for lane in range(0, LANES, 2):
        prefetch(address(dofmap) + np.uint64(4 * dofmap.shape[1]) * np.uint64(cells[lane]))
