"""Energy accounting of nodal contact, the same for surfaces and for planes, and the impulse that planes give."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.vectors.exact import quantum, two_constants
from burst_fenicsx.kernels.vectors.rows import sum_columns

if TYPE_CHECKING:
    from mpi4py import MPI

    from burst_fenicsx.kernels.contact.planes import PlaneState
    from burst_fenicsx.kernels.contact.springs import Collisions
    from burst_fenicsx.mechanics.fields import BurstFields

__all__ = ["CONTACT_FORCES", "NodeContact", "PlaneImpulse"]

CONTACT_FORCES = 2.0**8
"""How much coarser contact's forces are rounded than those of cells: where walls collide, several contacts push one
node, together by more than four times the largest force of a cell, up to which sums of the cells' terms are exact."""

_LARGEST_FORCE = 2.0**57  # of a plane on a node, in quanta of the nodal forces: 64 times the largest force of a cell


class NodeContact:
    """Contact of this rank's nodes; `state` holds the kernels' arrays."""

    state: Collisions | PlaneState
    _fields: BurstFields

    @property
    def energies(self) -> np.ndarray:
        """Spring energy now and friction in the last step (J), exact, on this rank's nodes."""
        rows = np.arange(len(self.state.energies), dtype=np.int32)
        total: np.ndarray = sum_columns(self.state.energies, rows, self._fields.grid.rounding)
        return total


class PlaneImpulse:
    """Impulse that the planes have given to the nodes of all ranks, by the trapezoidal rule over contact's steps.

    A rank's forces are kept, in two exact bins, until all ranks' are summed: that takes no message in every step, and
    the sums do not depend on which rank has a node.

    Parameters
    ----------
    comm : communicator. fields : this rank's fields.

    Attributes
    ----------
    constants : of the two bins, see `exact.two_constants`.
    """

    def __init__(self, comm: MPI.Comm, fields: BurstFields) -> None:
        self._comm = comm
        largest = _LARGEST_FORCE * quantum(fields.nodes.rounding)
        nodes = int(fields.mesh.domain.geometry.index_map().size_global)
        self.constants = two_constants(largest, nodes)
        self._given, self._force = np.zeros(3), np.zeros(3)
        self._steps: list[float] = []
        self._forces: list[np.ndarray] = []

    def add(self, step: float, force: np.ndarray) -> None:
        """Add the step (s) that led here, at whose end this rank's nodes get the `force` (2, 3) in N, in two bins."""
        self._steps.append(step)
        self._forces.append(force)
        if self._comm.size == 1:
            self._settle()

    def _settle(self) -> None:
        """Add what all ranks have kept; collective."""
        if not self._steps:
            return
        forces = np.array(self._forces)
        if self._comm.size > 1:
            forces = self._comm.allreduce(forces)
        for step, force in zip(self._steps, forces.sum(axis=1), strict=True):
            self._given += 0.5 * step * (self._force + force)
            self._force = force
        self._steps, self._forces = [], []

    def given(self) -> np.ndarray:
        """Impulse (3,) in N s so far; collective."""
        self._settle()
        return self._given.copy()

    def state(self) -> np.ndarray:
        """Impulse so far in N s and force now in N, (6,), for the checkpoint; collective."""
        self._settle()
        return np.concatenate([self._given, self._force])

    def restore(self, state: np.ndarray) -> None:
        """Go on from what `state` gave."""
        self._given, self._force = state[:3].copy(), state[3:].copy()
        self._steps, self._forces = [], []
