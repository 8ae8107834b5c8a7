"""Cells sorted into blocks of one material, blocks into chunks, chunks into colours that share no node."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from burst_fenicsx.kernels.colours import colour_groups
from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.kernels.state import Schedule

__all__ = ["Blocks", "arrange", "chunk_size"]

_LEAST_CELLS, _MOST_CELLS, _CHUNKS = 256, 4096, 32


def chunk_size(cells: int) -> int:
    """Cells of a chunk: enough chunks to share among threads, then chunks so large that they share few nodes.

    It does not depend on the number of threads, so that the order of summation does not.
    """
    return min(max(cells // _CHUNKS, _LEAST_CELLS), _MOST_CELLS)


@dataclass(frozen=True)
class Blocks:
    """Cells in blocks: what `Grid` and `Schedule` are made of.

    Attributes
    ----------
    cells : (blocks, LANES) int32, padded with the last cell of the block.
    count, material : (blocks,) int32.
    schedule : the chunks and their colours.
    """

    cells: np.ndarray
    count: np.ndarray
    material: np.ndarray
    schedule: Schedule

    @property
    def slots(self) -> tuple[np.ndarray, np.ndarray]:
        """Slots that hold a cell and the cells that they hold."""
        held = np.arange(LANES)[None, :] < self.count[:, None]
        return np.flatnonzero(held), self.cells[held]


def arrange(order: np.ndarray, dofmap: np.ndarray, material: np.ndarray, is_charge: np.ndarray) -> Blocks:
    """Arrange cells in blocks, chunks and colours.

    Parameters
    ----------
    order : cells in an order in which neighbours lie near each other (for a round: along its axis).
    dofmap : (cells, 8) int32 nodes.
    material : (cells,) int32 row of the cell's material.
    is_charge : (materials,) bool.
    """
    rows: list[np.ndarray] = []
    counts: list[int] = []
    materials: list[int] = []
    first_block = [0]
    first_charge = []
    chunk_of_cell = np.empty(len(material), dtype=np.int32)
    ranked = np.lexsort((np.arange(len(is_charge)), is_charge))
    size = chunk_size(len(order))
    for chunk, start in enumerate(range(0, len(order), size)):
        members = order[start : start + size]
        chunk_of_cell[members] = chunk
        charge_starts = None
        for row in ranked:
            if is_charge[row] and charge_starts is None:
                charge_starts = len(rows)
            own = members[material[members] == row]
            for k in range(0, len(own), LANES):
                block = own[k : k + LANES]
                rows.append(np.concatenate([block, np.full(LANES - len(block), block[-1])]))
                counts.append(len(block))
                materials.append(int(row))
        first_charge.append(len(rows) if charge_starts is None else charge_starts)
        first_block.append(len(rows))
    colour = _colour_chunks(chunk_of_cell, dofmap, len(first_charge))
    chunk_order = np.argsort(colour, kind="stable")
    colours = int(colour.max()) + 1 if len(colour) else 0
    offset = np.searchsorted(colour[chunk_order], np.arange(colours + 1))
    schedule = Schedule(
        colour_offset=offset.astype(np.int32),
        chunk=chunk_order.astype(np.int32),
        first_block=np.array(first_block, dtype=np.int32),
        first_charge=np.array(first_charge, dtype=np.int32),
    )
    cells = np.array(rows, dtype=np.int32).reshape(-1, LANES)
    return Blocks(cells, np.array(counts, dtype=np.int32), np.array(materials, dtype=np.int32), schedule)


def _colour_chunks(chunk_of_cell: np.ndarray, dofmap: np.ndarray, chunks: int) -> np.ndarray:
    """Greedy colouring of the chunks, two being neighbours if they share a node."""
    order = np.argsort(chunk_of_cell, kind="stable")
    first = np.searchsorted(chunk_of_cell[order], np.arange(chunks + 1))
    colour = np.empty(chunks, dtype=np.int32)
    words = 1
    while not colour_groups(
        order, first, dofmap, np.zeros((int(dofmap.max(initial=-1)) + 1, words), np.uint64), colour
    ):
        words *= 2
    return colour
