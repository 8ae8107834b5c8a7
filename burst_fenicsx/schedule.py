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
    size = chunk_size(len(order))
    chunks = -(-len(order) // size)
    chunk_of_cell = np.empty(len(material), dtype=np.int32)
    chunk_of_cell[order] = np.arange(len(order), dtype=np.int32) // size
    # Within a chunk the solid materials come first, and the cells of each keep their order.
    rank = np.empty(len(is_charge), dtype=np.int64)
    rank[np.lexsort((np.arange(len(is_charge)), is_charge))] = np.arange(len(is_charge))
    key = chunk_of_cell[order] * np.int64(len(is_charge)) + rank[material[order]]
    sorted_cells, runs = order[np.argsort(key, kind="stable")], np.bincount(key, minlength=chunks * len(is_charge))
    blocks_of_run = -(-runs // LANES)
    run = np.repeat(np.arange(len(runs)), blocks_of_run)
    within = np.arange(len(run)) - (np.cumsum(blocks_of_run) - blocks_of_run)[run]
    start = (np.cumsum(runs) - runs)[run] + LANES * within
    counts = np.minimum(runs[run] - LANES * within, LANES)
    cells = sorted_cells[start[:, None] + np.minimum(np.arange(LANES), counts[:, None] - 1)]
    materials = material[cells[:, 0]]
    of_chunk = blocks_of_run.reshape(chunks, len(is_charge))
    first_block = np.concatenate([[0], np.cumsum(of_chunk.sum(axis=1))])
    solid_blocks = of_chunk[:, : np.count_nonzero(~is_charge)].sum(axis=1)
    colour = _colour_chunks(chunk_of_cell, dofmap, chunks)
    chunk_order = np.argsort(colour, kind="stable")
    colours = int(colour.max()) + 1 if len(colour) else 0
    offset = np.searchsorted(colour[chunk_order], np.arange(colours + 1))
    schedule = Schedule(
        colour_offset=offset.astype(np.int32),
        chunk=chunk_order.astype(np.int32),
        first_block=first_block.astype(np.int32),
        first_charge=(first_block[:-1] + solid_blocks).astype(np.int32),
    )
    return Blocks(cells.astype(np.int32), counts.astype(np.int32), materials.astype(np.int32), schedule)


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
