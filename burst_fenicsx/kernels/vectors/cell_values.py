"""Numbers that a block's cells keep, copied to rows, a lane a cell, and back.

They lie by slot, a block behind the other, or by cell; of a row of cells they are a run there too.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, block_kernel, lane_function
from burst_fenicsx.kernels.vectors.transposition import (
    WIDTH,
    address,
    addresses,
    copy_run,
    load_singles,
    prefetch,
    store_singles,
)

__all__ = ["Cells", "cells_of_lanes", "load_cells", "load_slots", "prefetch_slots", "store_cells", "store_slots"]

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


@block_kernel
def load_cells(
    cells: np.ndarray, in_rows: np.ndarray, start: np.uint64, points: int, rows: np.ndarray, row: int
) -> None:
    """Copy a number of each of a block's cells to a row.

    Parameters
    ----------
    cells, in_rows : of the block, as of `nodal_values.gather_modes`.
    start : address of the first cell's number; a cell has so many `points`, with a number each.
    rows, row : the row of the scratch.
    """
    for first in range(0, LANES, WIDTH):
        own = cells_of_lanes(cells, first)
        if points == 1 and in_rows[first // WIDTH]:
            copy_run(start + _BYTES * own[0], _place(rows, row * LANES + first))
        else:
            load_singles(addresses(start, _BYTES * np.uint64(points), own), rows, row * LANES + first)


@block_kernel
def store_cells(
    cells: np.ndarray, in_rows: np.ndarray, start: np.uint64, points: int, rows: np.ndarray, row: int
) -> None:
    """Copy a row back to the cells, the reverse of `load_cells`; of lanes with the same cell the first one's counts.

    Lanes that repeat a block's last cell may have started from other numbers of their slots.
    """
    for first in range(LANES - WIDTH, -1, -WIDTH):
        own = cells_of_lanes(cells, first)
        if points == 1 and in_rows[first // WIDTH]:
            copy_run(_place(rows, row * LANES + first), start + _BYTES * own[0])
        else:
            store_singles(rows, row * LANES + first, addresses(start, _BYTES * np.uint64(points), own))


@lane_function
def prefetch_slots(block: int, values: np.ndarray) -> None:
    """Bring a block's `values` (slots,) near."""
    for first in range(0, LANES, WIDTH):
        prefetch(_place(values, block * LANES + first))
