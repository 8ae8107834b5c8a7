"""Which hexahedra of casings and fuzes are torn metal by now, and their release."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.cells.erosion import BEFORE, NOW, are_torn
from burst_fenicsx.kernels.step.assembly import cell_volumes

if TYPE_CHECKING:
    from burst_fenicsx.mechanics.fields import BurstFields

__all__ = ["TornMetal"]


class TornMetal:
    """Looks for torn metal among one rank's cells.

    Parameters
    ----------
    fields : the state, from before its first step or restored; its initial places are read.
    """

    def __init__(self, fields: BurstFields) -> None:
        self._fields = fields
        self._initial_volumes: np.ndarray = cell_volumes(fields.start, fields.mesh.dofmap)

    def release(self) -> None:
        """Mark the cells without strength that have the shape of torn metal."""
        state, mesh = self._fields, self._fields.mesh
        cells = np.flatnonzero(state.without_strength() & ~state.released)
        torn = np.zeros(len(cells), dtype=bool)
        relative = state.blocks.by_cell(state.grid.volume)[cells] / self._initial_volumes[cells]
        are_torn(cells, state.nodes.position, mesh.dofmap, relative, torn)
        self._mark(cells[torn], NOW)

    def release_at_end(self) -> None:
        """Release what is folded though it is compressed: after the last step it has no neighbours to hold apart."""
        state = self._fields
        cells = np.flatnonzero(state.folded() & state.without_strength())
        self._mark(cells, BEFORE)
        state.solid.stress[cells] = 0.0

    def _mark(self, cells: np.ndarray, flag: int) -> None:
        state = self._fields
        flags = state.blocks.by_cell(state.solid.eroded)
        flags[cells] = flag
        state.solid.eroded[:] = state.blocks.by_slot(flags)
