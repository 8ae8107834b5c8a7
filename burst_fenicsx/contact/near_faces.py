"""Faces that the nodes of a rank may meet: those of its own cells, and those that other ranks send it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.geometry.boxes import box_around, meet

if TYPE_CHECKING:
    from mpi4py import MPI

    from burst_fenicsx.contact.surfaces import ContactSurfaces
    from burst_fenicsx.meshing.distributed import DistributedMesh

__all__ = ["NearFaces"]


class NearFaces:
    """Brings a rank the faces near its nodes, with the places of their corners.

    Every rank knows the boxes of the faces of its own cells, and sends those that meet the box around another rank's
    searching nodes to that rank: what a rank receives goes with the surface near it, not with all surface.

    Parameters
    ----------
    comm : communicator. surfaces : of the whole mesh. mesh : this rank's share of it.

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
        searching : (n, 3) m, places of the searching nodes.
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
        for chosen, places in pieces:
            position[np.unique(self._faces[chosen])] = places
            self.received += len(places)
        found = np.concatenate([chosen for chosen, _ in pieces]) if pieces else np.zeros(0, dtype=np.int32)
        return np.sort(found)
