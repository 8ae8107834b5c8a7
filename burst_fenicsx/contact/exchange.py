"""What contact brings from other ranks: rows of nodal arrays kept up to date, sums given back, faces near a rank."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from dolfinx import la
from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.kernels.geometry.boxes import box_around, meet

if TYPE_CHECKING:
    from burst_fenicsx.contact.surfaces import ContactSurfaces
    from burst_fenicsx.meshing.distributed import DistributedMesh

__all__ = ["CONTACT_FORCES", "Halo", "NearFaces"]

CONTACT_FORCES = 2.0**8
"""How much coarser contact's forces are rounded than those of cells: where walls collide, several contacts push one
node, together by more than four times the largest force of a cell, up to which sums of the cells' terms are exact."""


_COLUMNS = 7  # the most that is carried: positions, velocities and a load


class Halo:
    """Rows of arrays over all surface nodes, of which every rank keeps its own and those it needs up to date.

    dolfinx carries them: the needed rows are the ghosts of an index map whose owned items are a rank's own rows.

    Parameters
    ----------
    comm : communicator. own : rows that this rank owns. rows : their number on all ranks.

    Attributes
    ----------
    needed : rows of other ranks that this rank needs. asked : own rows that others need.
    """

    def __init__(self, comm: MPI.Comm, own: np.ndarray, rows: int) -> None:
        self._comm = comm
        self.needed = self.asked = np.zeros(0, dtype=np.int32)
        if comm.size == 1:
            return
        self._owner = np.zeros(rows, dtype=np.int32)
        self._owner[own] = comm.rank
        comm.Allreduce(MPI.IN_PLACE, self._owner)
        self._own = np.flatnonzero(self._owner == comm.rank)
        self._number = np.empty(rows, dtype=np.int64)  # dolfinx counts rank by rank
        self._number[np.argsort(self._owner, kind="stable")] = np.arange(rows)

    def need(self, rows: np.ndarray) -> None:
        """Ask for rows from now on, each named once; those of one's own are always there. Collective."""
        if self._comm.size == 1:
            return
        self.needed = rows[self._owner[rows] != self._comm.rank].astype(np.int32)
        ghosts = self._number[self.needed]
        self._map = compat.index_map(self._comm, len(self._own), ghosts, self._owner[self.needed])
        # One vector carries all: ranks have to wait for each other where one is made.
        self._vector = la.vector(self._map, _COLUMNS)
        self._values = values = self._vector.array.reshape(-1, _COLUMNS)
        values[:] = 0.0
        values[len(self._own) :, 0] = 1.0
        compat.add_ghosts(self._vector)
        self._asked = np.flatnonzero(values[: len(self._own), 0])
        self.asked = self._own[self._asked].astype(np.int32)

    def fetch(self, *arrays: np.ndarray) -> None:
        """Bring the needed rows of arrays (rows, n) from their owners, together; of all that share rows."""
        if self._comm.size == 1:
            return
        values, first = self._values, 0
        for array in arrays:
            values[self._asked, first : first + array.shape[1]] = array[self.asked]
            first += array.shape[1]
        self._vector.scatter_forward()
        received, first = values[len(self._own) :], 0
        for array in arrays:
            array[self.needed] = received[:, first : first + array.shape[1]]
            first += array.shape[1]

    def give(self, sums: np.ndarray) -> None:
        """Add what this rank has in the needed rows of `sums` (rows, n) to their owners' rows; of all that share rows.

        Terms are added in the order of the ranks; where that must not matter, sums have to be exact.
        """
        if self._comm.size == 1:
            return
        values, columns = self._values, sums.shape[1]
        values[self._asked] = 0.0
        values[len(self._own) :, :columns] = sums[self.needed]
        compat.add_ghosts(self._vector)
        sums[self.asked] += values[self._asked, :columns]


class NearFaces:
    """Brings a rank the faces near its nodes, with the positions of their corners.

    Every rank knows the boxes of the faces of its own cells, and sends those that meet the box around another rank's
    searching nodes to that rank: what a rank receives goes with the surface near it, not with all surface.

    Parameters
    ----------
    comm : communicator. surfaces : of the whole mesh. mesh : as this rank has it.

    Attributes
    ----------
    own : (k,) int32 faces of this rank's cells, ascending; all faces on one rank.
    received : how many surface nodes the last exchange brought.
    """

    def __init__(self, comm: MPI.Comm, surfaces: ContactSurfaces, mesh: DistributedMesh) -> None:
        self._comm = comm
        self._faces = surfaces.faces
        self.received = 0
        self.own = np.arange(len(surfaces.faces), dtype=np.int32)
        if comm.size > 1:
            here = np.zeros(int(surfaces.cell.max(initial=-1)) + 1, dtype=bool)
            here[mesh.cell[mesh.cell < len(here)]] = True
            self.own = self.own[here[surfaces.cell]]

    def exchange(self, faces: np.ndarray, boxes: np.ndarray, searching: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Other ranks' faces (k,) int32, ascending, that meet the box around this rank's searching nodes; collective.

        Parameters
        ----------
        faces : (f,) own ones that are to be met. boxes : (f, 6) m, theirs, widened by the reach.
        searching : (n, 3) m, positions of the searching nodes.
        position : (surface nodes, 3) m, known for the corners of own faces, and set for those of the faces received.
        """
        around = box_around(searching, searching)
        everyone = np.array(self._comm.allgather(around))
        own = box_around(boxes[:, :3], boxes[:, 3:])
        messages: list[tuple[np.ndarray, np.ndarray] | None] = [None] * self._comm.size
        for rank in np.flatnonzero(meet(everyone, own)):
            chosen = faces[meet(boxes, everyone[rank])]
            if rank != self._comm.rank and len(chosen):
                messages[rank] = chosen, position[np.unique(self._faces[chosen])]
        pieces = [piece for piece in self._comm.alltoall(messages) if piece is not None]
        self.received = 0
        for chosen, corners in pieces:
            position[np.unique(self._faces[chosen])] = corners
            self.received += len(corners)
        found = np.concatenate([chosen for chosen, _ in pieces]) if pieces else np.zeros(0, dtype=np.int32)
        return np.sort(found)
