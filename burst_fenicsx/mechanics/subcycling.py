"""Local time stepping: most cells take long steps, the few thin ones take short steps in between.

An asynchronous variational integrator (Lew, Marsden, Ortiz and West 2003, Archive for Rational Mechanics and Analysis
167) with steps in powers of two. Every cell acts on its nodes by impulses, its own step times its force, at the ends of
its own steps; between impulses nodes move uniformly. Each impulse of a cell sums to nothing over its nodes, so momentum
is conserved to round-off, and where all cells are of one level this is the semi-implicit Euler of Eq. 3. Levels of
cells that share a node differ by one at most.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from burst_fenicsx.kernels.constants import BELOW_CONTACT, CONTACT_CANDIDATES, HIGHEST_LEVEL, LONGEST_STEP
from burst_fenicsx.kernels.state import Motion

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.contact import ContactForces
    from burst_fenicsx.mechanics.fields import BurstFields


class Subcycling:
    """Levels of the cells and the nodes of one rank.

    Parameters
    ----------
    fields : the state; its blocks are arranged again when levels change.
    contact : None where there is none.

    Attributes
    ----------
    contact : whether anything may touch.
    motion : how the nodes move.
    highest : level of the shortest steps. contact_level : of contact.
    step : the macro step that was chosen (s). cell_steps : steps of this rank's cells in a macro step.
    """

    def __init__(self, fields: BurstFields, contact: ContactForces | None = None) -> None:
        self._fields = fields
        self._comm = fields.mesh.comm
        nodes = len(fields.mass)
        self.motion = Motion(
            order=np.arange(nodes, dtype=np.int32),
            level=np.zeros(nodes, dtype=np.int8),
            has_coarser_cell=np.zeros(nodes, dtype=np.int8),
            inverse_mass=fields.inverse_mass,
            moving=np.array([nodes]),
        )
        self._corners = np.ascontiguousarray(fields.mesh.dofmap.T)
        self._around = _cells_around(fields.mesh.all_dofmap, nodes)
        # Of the cells around each node, as they were looked at last.
        self._finest, self._coarsest = np.zeros(nodes, dtype=np.int8), np.zeros(nodes, dtype=np.int8)
        self._looked_at: np.ndarray | None = None
        self.highest = 0
        self.contact_level = 0
        self.step = 0.0
        self._cells = self._comm.allreduce(fields.mesh.cells)
        self.cell_steps = fields.mesh.cells
        self.contact = contact is not None and contact.exists
        self._touched = contact.touched if contact is not None and self.contact else np.zeros(nodes, dtype=bool)
        self._beside_contact = self._touched[fields.mesh.dofmap].any(axis=1)
        # dolfinx carries the levels to other ranks' copies of the cells and nodes.
        self._of_cells: Any = None
        self._of_nodes: Any = None
        if self._comm.size > 1:
            self._of_cells = fem.Function(fields.functions["pressure"].function_space)
            self._of_nodes = fem.Function(fields.mesh.vector_space)

    def choose(self, allowed: Callable[[float], np.ndarray], whole: float, contact_step: float | None) -> np.ndarray:
        """Choose the macro step and the cells' levels so that all advance at the lowest cost; collective.

        Parameters
        ----------
        allowed : gives for a macro step (s) the steps that the cells may take (cells,) in s.
        whole : the step (s) that all cells may take together.
        contact_step : step of contact (s), if there is any; the longest is this times a power of two.

        Returns
        -------
        The levels (cells,) int8, for `set_levels`.
        """
        comm = self._comm
        base = contact_step or comm.allreduce(float(allowed(0.0).min(initial=np.inf)), op=MPI.MIN)
        best, lowest, chosen = -1, self._cells / whole, np.zeros(self._fields.mesh.cells, dtype=np.int8)
        for candidate in range(CONTACT_CANDIDATES if contact_step else HIGHEST_LEVEL):
            step = base * 2**candidate
            if candidate and step > LONGEST_STEP:
                break
            level = self._wanted(step, allowed(step), max(candidate - BELOW_CONTACT, 0))
            counts = np.bincount(level, minlength=HIGHEST_LEVEL + 1)
            counts = comm.allreduce(counts) if comm.size > 1 else counts
            cost = float(counts @ 2.0 ** np.arange(len(counts))) / step
            if cost < lowest:
                best, lowest, chosen = candidate, cost, level
        self.step = base * 2**best if best >= 0 else whole
        self.contact_level = max(best, 0) if contact_step else 0
        return self._graded(chosen)

    def _wanted(self, step: float, allowed: np.ndarray, beside_contact: int) -> np.ndarray:
        """Level (cells,) int8 of each cell by its own allowed step (s) and, beside contact, at least that given."""
        with np.errstate(divide="ignore"):
            level = np.clip(np.ceil(np.log2(step / allowed) - 1e-9), 0, HIGHEST_LEVEL).astype(np.int8)
        least: np.ndarray = self._beside_contact * np.int8(beside_contact)
        return np.maximum(level, least, out=level)

    def _graded(self, level: np.ndarray) -> np.ndarray:
        """Raise levels until those of cells that share a node differ by one at most; collective."""
        while True:
            self._find_node_levels(level)
            wanted = level.copy()
            for corner in self._corners:
                np.maximum(wanted, self._finest[corner] - np.int8(1), out=wanted)
            raised = np.count_nonzero(wanted > level)
            level[:] = wanted
            if self._comm.size > 1:
                raised = self._comm.allreduce(raised)
            if raised == 0:
                self._looked_at = level
                return level

    def _find_node_levels(self, level: np.ndarray) -> None:
        """Highest and lowest level of the cells around every node, from those of this rank's cells; collective."""
        mesh, finest, coarsest = self._fields.mesh, self._finest, self._coarsest
        if self._of_cells is not None:
            self._of_cells.x.array[: mesh.cells] = level
            self._of_cells.x.scatter_forward()
            level = self._of_cells.x.array.astype(np.int8)
        finest[:] = coarsest[:] = level[self._around[0]]
        for cell in self._around[1:]:
            around = level[cell]
            np.maximum(finest, around, out=finest)
            np.minimum(coarsest, around, out=coarsest)
        if self._of_nodes is None:
            return
        # Around the outer nodes of other ranks' cells some cells are missing here: their owner has them all.
        both = self._of_nodes.x.array.reshape(-1, 3)
        both[:, 0], both[:, 1] = finest, coarsest
        self._of_nodes.x.scatter_forward()
        finest[:], coarsest[:] = both[:, 0], both[:, 1]

    def set_levels(self, level: np.ndarray) -> None:
        """Take over levels (cells,) int8 that differ by one at most where cells that move share a node; collective."""
        if level is not self._looked_at:
            self._find_node_levels(level)
        nodes = self._fields.nodes
        finest = nodes.finest
        # Cells beside contact lie one level below it at most.
        finest[:] = np.where(self._touched, np.maximum(self._finest, self.contact_level), self._finest)
        highest = max(int(level.max(initial=0)), self.contact_level)
        self.highest = self._comm.allreduce(highest, op=MPI.MAX) if self._comm.size > 1 else highest
        order = np.argsort(-finest, kind="stable").astype(np.int32)
        has_coarser_cell = (self._coarsest < finest).astype(np.int8)
        moving = np.array([np.count_nonzero(finest >= min_level) for min_level in range(self.highest + 1)])
        self.motion = Motion(order, finest[order], has_coarser_cell[order], self._fields.inverse_mass[order], moving)
        self.cell_steps = int((1 << level[level >= 0].astype(np.int64)).sum())
        nodes.mean[:] = nodes.velocity
        self._fields.regroup(level, self.highest)


def _cells_around(dofmap: np.ndarray, nodes: int) -> np.ndarray:
    """Cells around each node (most, nodes), where there are fewer some of them twice; `dofmap` (cells, corners)."""
    corners = dofmap.ravel()
    order = np.argsort(corners, kind="stable")
    first = np.searchsorted(corners[order], np.arange(nodes + 1))
    number = np.minimum(np.arange(np.diff(first).max(initial=1))[:, None], np.diff(first) - 1)
    around: np.ndarray = (order // dofmap.shape[1])[first[:-1] + number]
    return around
