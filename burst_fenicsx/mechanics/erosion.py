"""Element erosion: which cells of casings and fuzes are no continuum any more, in every geometry by one rule."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.cells.erosion import BEFORE, NOW
from burst_fenicsx.kernels.cells.layout import SOLID_PARAMETERS
from burst_fenicsx.kernels.constants import FOLDED_VOLUME, NOTHING_LEFT
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.mechanics.fields import BurstFields

__all__ = ["ElementErosion"]


class ElementErosion:
    """Looks for cells to erode among one rank's cells.

    Parameters
    ----------
    fields : the state.
    """

    def __init__(self, fields: BurstFields) -> None:
        self._fields = fields

    def erode(self) -> None:
        """Mark metal without strength that has folded while it was expanded, or of which hardly any volume is left.

        Folded metal that is compressed still holds its neighbours apart; unfolded metal that is mostly void bears
        nothing, but is the surface that products and other metal meet.
        """
        state, mesh = self._fields, self._fields.mesh
        cells = np.flatnonzero(state.without_strength() & ~state.eroded)
        density = state.solid.parameters[
            len(Part) * mesh.round[cells] + mesh.part[cells], SOLID_PARAMETERS.index("density")
        ]
        relative = state.blocks.by_cell(state.grid.volume)[cells] * density / state.cell_mass[cells]
        expanded = relative >= FOLDED_VOLUME
        folded = np.zeros(len(cells), dtype=bool)
        folded[expanded] = state.folded(cells[expanded])
        self._mark(cells[folded | ~(relative > NOTHING_LEFT)], NOW)

    def erode_at_end(self) -> None:
        """Erode what is folded though it is compressed: after the last step it has no neighbours to hold apart."""
        state = self._fields
        cells = np.flatnonzero(state.folded() & state.without_strength())
        self._mark(cells, BEFORE)
        state.solid.stress[cells] = 0.0

    def _mark(self, cells: np.ndarray, flag: int) -> None:
        if len(cells):
            state = self._fields
            flags = state.blocks.by_cell(state.solid.eroded)
            flags[cells] = flag
            state.solid.eroded[:] = state.blocks.by_slot(flags)
