"""Cells that are no continuum any more: eroded ones of casings and fuzes, and lost ones, which stop the burst."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.cells.erosion import BEFORE, NOW
from burst_fenicsx.kernels.cells.layout import SOLID_PARAMETERS
from burst_fenicsx.kernels.constants import FOLDED_VOLUME, NOTHING_LEFT
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.kernels.state import Totals
    from burst_fenicsx.mechanics.fields import BurstFields


def erode(state: BurstFields) -> None:
    """Mark metal without strength that has folded while it was expanded, or of which hardly any volume is left.

    Folded metal that is compressed still holds its neighbours apart; unfolded metal that is mostly void bears nothing,
    but is the surface that products and other metal meet.
    """
    mesh = state.mesh
    cells = np.flatnonzero(state.without_strength() & ~state.eroded)
    row = len(Part) * mesh.round[cells] + mesh.part[cells]
    density = state.solid.parameters[row, SOLID_PARAMETERS.index("density")]
    relative = state.blocks.by_cell(state.grid.volume)[cells] * density / state.cell_mass[cells]
    expanded = relative >= FOLDED_VOLUME
    folded = np.zeros(len(cells), dtype=bool)
    folded[expanded] = state.folded(cells[expanded])
    _mark(state, cells[folded | ~(relative > NOTHING_LEFT)], NOW)


def erode_at_end(state: BurstFields) -> None:
    """Erode what is folded though it is compressed: after the last step it has no neighbours to hold apart."""
    cells = np.flatnonzero(state.folded() & state.without_strength())
    _mark(state, cells, BEFORE)
    state.solid.stress[cells] = 0.0


def _mark(state: BurstFields, cells: np.ndarray, flag: int) -> None:
    if len(cells):
        flags = state.blocks.by_cell(state.solid.eroded)
        flags[cells] = flag
        state.solid.eroded[:] = state.blocks.by_slot(flags)


def check_cells(state: BurstFields, totals: Totals, stable_step: float, time: float) -> None:
    """Stop if a cell has turned inside out or anything is not a number; collective.

    Parameters
    ----------
    state : the state. totals : of its last step.
    stable_step : of all ranks (s). time : now (s).
    """
    smallest, comm = totals.smallest_volume, state.mesh.comm
    lost = int(np.argmin(smallest)) if smallest.size else -1
    message = ""
    if lost >= 0 and not smallest[lost] > 0.0:
        message = _in_words(state, int(totals.smallest[lost]))
    if not stable_step > 0.0:
        message = message or "the stable step is NaN"
    if comm.size > 1:
        messages = [text for text in comm.allgather(message) if text]
        message = messages[0] if messages else ""
    if message:
        raise NumericalStop(f"lost cell: {message}", time)


def _in_words(state: BurstFields, cell: int) -> str:
    mesh = state.mesh
    x, y, z = state.nodes.position[mesh.dofmap[cell]].mean(axis=0) * 1e3
    return (
        f"cell {mesh.cell[cell]} of the {Part(int(mesh.part[cell])).name.lower()} of round {mesh.round[cell]}, "
        f"station {mesh.station[cell] * 1e3:.1f} mm from the nose, now at ({x:.1f}, {y:.1f}, {z:.1f}) mm, "
        "has turned inside out"
    )
