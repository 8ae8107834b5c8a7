"""Cells sorted into blocks of one material and one step, blocks into chunks, chunks into colours that share no node."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from burst_fenicsx.kernels.lanes import LANES
from burst_fenicsx.kernels.state import Schedule

AT_REST = -1
"""Level of cells that take no steps."""

_MIN_CELLS, _MOST_CELLS, _CHUNKS = 256, 1024, 32


def chunk_size(cells: int) -> int:
    """Cells of a chunk: enough chunks to share among threads, then chunks so large that they share few nodes.

    It does not depend on the number of threads, so that the order of summation does not.
    """
    return min(max(cells // _CHUNKS, _MIN_CELLS), _MOST_CELLS)


@dataclass(frozen=True)
class Blocks:
    """Cells in blocks: what `Grid` and `Schedule` are made of.

    Attributes
    ----------
    cells : (blocks, LANES) int32, padded with the last cell of the block.
    count, material, level : (blocks,) int32; a block of level l takes 2^l steps in a longest one.
    schedule : the chunks and their colours.
    """

    cells: np.ndarray
    count: np.ndarray
    material: np.ndarray
    level: np.ndarray
    schedule: Schedule

    @cached_property
    def slots(self) -> tuple[np.ndarray, np.ndarray]:
        """Slots that hold a cell and the cells that they hold."""
        held = np.arange(LANES)[None, :] < self.count[:, None]
        return np.flatnonzero(held), self.cells[held]

    @cached_property
    def slot_of_cell(self) -> np.ndarray:
        """Slot that holds each cell, (cells,) int32."""
        slots, held = self.slots
        slot = np.empty(len(held), dtype=np.int32)
        slot[held] = slots
        return slot

    @property
    def cell_levels(self) -> np.ndarray:
        """Level of each cell, (cells,) int32."""
        levels: np.ndarray = self.level[self.slot_of_cell // LANES]
        return levels

    def nodes(self, dofmap: np.ndarray) -> np.ndarray:
        """Nodes of the cells by corner and lane, (blocks, corners, LANES) int32; `dofmap` (cells, corners) int32."""
        return np.ascontiguousarray(dofmap[self.cells].transpose(0, 2, 1))

    def by_slot(self, values: np.ndarray) -> np.ndarray:
        """Values of cells (cells, ...) in the order of the slots; padded lanes repeat their block's last cell."""
        result: np.ndarray = values[self.cells.ravel()]
        return result

    def by_cell(self, values: np.ndarray) -> np.ndarray:
        """Values of slots (slots, ...) in the order of the cells."""
        result: np.ndarray = values[self.slot_of_cell]
        return result


class Chunks:
    """Cells in chunks and colours, which stay; their blocks are arranged again when the cells' steps change.

    Parameters
    ----------
    dofmap : (cells, corners) int32 nodes; neighbours have to lie near each other in the order of the cells.
    material : (cells,) int32 row of the cell's material.
    is_charge : (materials,) bool.
    size : cells of a chunk; by default `chunk_size`.
    """

    def __init__(
        self, dofmap: np.ndarray, material: np.ndarray, is_charge: np.ndarray, size: int | None = None
    ) -> None:
        cells = len(material)
        self._material, self._materials = material, len(is_charge)
        self._charge = np.asarray(is_charge)[material]
        self._chunk = np.arange(cells) // (size or chunk_size(cells))
        self._chunks = int(self._chunk[-1]) + 1 if cells else 0
        colour = _colour_chunks(self._chunk, dofmap, self._chunks)
        colours = int(colour.max()) + 1 if len(colour) else 0
        self._chunk_order = np.argsort(colour, kind="stable").astype(np.int32)
        self._colour_offset = np.searchsorted(colour[self._chunk_order], np.arange(colours + 1)).astype(np.int32)

    def blocks(self, level: np.ndarray, highest: int = 0) -> Blocks:
        """Arrange the cells in blocks by the levels of their steps, (cells,), and the highest of all ranks.

        Within a chunk solid cells come before charge, and cells of short steps before those of long ones, and of none:
        what takes part in a step lies together.
        """
        below = int(level.max(initial=0)) - level.astype(np.int64)
        key = ((2 * self._chunk + self._charge) * (below.max(initial=0) + 1) + below) * self._materials + self._material
        order = np.argsort(key.astype(np.min_scalar_type(key.max(initial=0))), kind="stable")  # of few bits: quick
        chunk, charge, levels = self._chunk[order], self._charge[order], level[order]
        material = self._material[order]
        starts = np.flatnonzero(np.diff(key[order], prepend=-1))
        sizes = np.diff(np.append(starts, len(order)))
        per_group = -(-sizes // LANES)
        group = np.repeat(np.arange(len(starts)), per_group)
        within = np.arange(len(group)) - np.repeat(np.cumsum(per_group) - per_group, per_group)
        first = starts[group] + within * LANES
        count = np.minimum(starts[group] + sizes[group] - first, LANES)
        lanes = first[:, None] + np.minimum(np.arange(LANES)[None, :], count[:, None] - 1)
        block_chunk, block_charge, block_level = chunk[first], charge[first], levels[first].astype(np.int32)
        first_block = np.searchsorted(block_chunk, np.arange(self._chunks))
        solid = np.bincount(block_chunk[~block_charge], minlength=self._chunks)
        active = np.zeros((self._chunks, highest + 1, 2), dtype=np.int32)
        for min_level in range(highest + 1):
            taking_part = block_level >= min_level
            for kind, of_kind in enumerate((~block_charge, block_charge)):
                active[:, min_level, kind] = np.bincount(block_chunk[taking_part & of_kind], minlength=self._chunks)
        schedule = Schedule(
            colour_offset=self._colour_offset,
            chunk=self._chunk_order,
            first_solid=first_block.astype(np.int32),
            first_charge=(first_block + solid).astype(np.int32),
            active=active,
        )
        cells = order[lanes].astype(np.int32).reshape(-1, LANES)
        return Blocks(cells, count.astype(np.int32), material[first].astype(np.int32), block_level, schedule)


def _colour_chunks(chunk_of_cell: np.ndarray, dofmap: np.ndarray, chunks: int) -> np.ndarray:
    """Greedy colouring of the chunks, two being neighbours if they share a node; their cells follow one another."""
    colour = np.empty(chunks, dtype=np.int32)
    taken: list[np.ndarray] = []  # of each colour, the nodes of its chunks
    first = np.searchsorted(chunk_of_cell, np.arange(chunks + 1))
    for chunk in range(chunks):
        nodes = dofmap[first[chunk] : first[chunk + 1]].ravel()
        free = (number for number, of_colour in enumerate(taken) if not of_colour[nodes].any())
        colour[chunk] = next(free, len(taken))
        if colour[chunk] == len(taken):
            taken.append(np.zeros(int(dofmap.max(initial=-1)) + 1, dtype=bool))
        taken[colour[chunk]][nodes] = True
    return colour
