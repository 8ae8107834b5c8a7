"""What contact brings from other ranks: rows of nodal arrays kept up to date, sums given back, faces near a rank."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, TypeAlias

import numpy as np
from mpi4py import MPI

from burst_fenicsx.contact.boxes import box_around, meet

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.contact.surfaces import ContactSurfaces
    from burst_fenicsx.meshing.distributed import DistributedMesh

__all__ = ["CONTACT_FORCES", "Fetched", "Given", "Halo", "NearFaces", "exchange_rows"]

CONTACT_FORCES = 2.0**8
"""How much coarser contact's forces are rounded than those of cells: where walls collide, several contacts push one
node, together by more than four times the largest force of a cell, up to which sums of the cells' terms are exact."""

_TAG = 17_406  # of contact's messages


class Halo:
    """Rows of arrays over all surface nodes, of which every rank keeps its own and those it needs up to date.

    Parameters
    ----------
    comm : communicator. own : rows that this rank owns. rows : their number on all ranks.

    Attributes
    ----------
    needed : rows of other ranks that this rank needs. asked : own rows that others need.
    taken, lent : the same rank by rank: rows of another rank, and rows that it needs.
    """

    def __init__(self, comm: MPI.Comm, own: np.ndarray, rows: int) -> None:
        self._comm = comm
        self.needed = self.asked = np.zeros(0, dtype=np.int32)
        self.taken: dict[int, np.ndarray] = {}
        self.lent: dict[int, np.ndarray] = {}
        if comm.size == 1:
            return
        self._owner = np.zeros(rows, dtype=np.int32)
        self._owner[own] = comm.rank
        comm.Allreduce(MPI.IN_PLACE, self._owner)

    def need(self, rows: np.ndarray) -> None:
        """Ask for rows from now on, each named once; those of one's own are always there. Collective."""
        comm = self._comm
        if comm.size == 1:
            return
        owner = self._owner[rows]
        by_rank = [rows[owner == rank].astype(np.int32) if rank != comm.rank else None for rank in range(comm.size)]
        self.taken = {rank: some for rank, some in enumerate(by_rank) if some is not None and len(some)}
        asked = comm.alltoall([self.taken.get(rank) for rank in range(comm.size)])
        self.lent = {rank: some for rank, some in enumerate(asked) if some is not None}
        nothing = [np.zeros(0, dtype=np.int32)]
        self.needed = np.concatenate([*self.taken.values(), *nothing])
        self.asked = np.unique(np.concatenate([*self.lent.values(), *nothing]))


Fetched: TypeAlias = tuple[Halo, "Sequence[np.ndarray]"]
"""Arrays (rows, n) whose needed rows are brought from their owners."""
Given: TypeAlias = tuple[Halo, np.ndarray]
"""Sums (rows, n) whose needed rows are added to those of their owners."""


def exchange_rows(comm: MPI.Comm, fetched: Sequence[Fetched], given: Sequence[Given]) -> None:
    """Exchange rows with other ranks, all in one message to each; of all that share rows.

    Where the order of the ranks must not matter, sums have to be exact.
    """
    if comm.size == 1:
        return
    sent: defaultdict[int, list[np.ndarray]] = defaultdict(list)
    expected: defaultdict[int, list[tuple[np.ndarray, np.ndarray, bool]]] = defaultdict(list)
    for halo, arrays in fetched:
        for array in arrays:
            for rank, rows in halo.lent.items():
                sent[rank].append(array[rows].ravel())
            for rank, rows in halo.taken.items():
                expected[rank].append((array, rows, False))
    for halo, sums in given:
        for rank, rows in halo.taken.items():
            sent[rank].append(sums[rows].ravel())
        for rank, rows in halo.lent.items():
            expected[rank].append((sums, rows, True))
    received = {
        rank: np.empty(sum(len(rows) * array.shape[1] for array, rows, _ in some)) for rank, some in expected.items()
    }
    requests = [comm.Irecv(values, rank, _TAG) for rank, values in received.items()]
    requests += [comm.Isend(np.concatenate(pieces), rank, _TAG) for rank, pieces in sent.items()]
    MPI.Request.Waitall(requests)
    for rank, some in expected.items():
        end = 0
        for array, rows, is_added in some:
            begin, end = end, end + len(rows) * array.shape[1]
            values = received[rank][begin:end].reshape(len(rows), -1)
            array[rows] = array[rows] + values if is_added else values


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
