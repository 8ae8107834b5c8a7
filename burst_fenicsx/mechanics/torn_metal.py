"""Which hexahedra of casings and fuzes are torn metal by now, and their release."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.assembly import cell_volumes
from burst_fenicsx.kernels.torn_metal import NOW, WHOLE, are_torn
from burst_fenicsx.problem import Part

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
        self._one_point = fields.solid.shear_strain.shape[1] == 1

    def release(self) -> None:
        """Mark the cells without strength that have the shape of torn metal; with 2x2x2 points none is released."""
        if not self._one_point:
            return
        state, solid, mesh = self._fields, self._fields.solid, self._fields.mesh
        inverse_limit = solid.parameters[len(Part) * mesh.round + mesh.part, 4]
        softened = solid.shear_strain[: mesh.cells, 0] * inverse_limit * state.blocks.by_cell(solid.softening_scale)
        flags = state.blocks.by_cell(solid.released)
        cells = np.flatnonzero((softened >= 1.0) & (flags == WHOLE))
        torn = np.zeros(len(cells), dtype=bool)
        relative = state.blocks.by_cell(state.grid.volume)[cells] / self._initial_volumes[cells]
        are_torn(cells, state.nodes.position, mesh.dofmap, relative, torn)
        flags[cells[torn]] = NOW
        solid.released[:] = state.blocks.by_slot(flags)
