"""Surface nodes of other ranks that a rank needs: brought from their owners, and forces given back to them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Halo"]


class Halo:
    """Rows of arrays over all surface nodes, of which every rank keeps its own and those it needs up to date.

    Parameters
    ----------
    comm : communicator.
    owner : (rows,) rank that owns each row, the same on every rank.

    Attributes
    ----------
    needed : rows of other ranks that this rank needs, by owner.
    asked : own rows that others need, by who asked; a row that several need is named several times.
    """

    def __init__(self, comm: MPI.Comm, owner: np.ndarray) -> None:
        self._comm = comm
        self._owner = owner
        self.needed = self.asked = np.zeros(0, dtype=np.int32)
        self._counts = self._asked_counts = np.zeros(comm.size, dtype=np.int64)
        self._exists = False

    def need(self, rows: np.ndarray) -> None:
        """Ask for rows from now on, each named once; those of one's own are always there. Collective."""
        if self._comm.size == 1:
            return
        others = rows[self._owner[rows] != self._comm.rank]
        self.needed = others[np.argsort(self._owner[others], kind="stable")].astype(np.int32)
        self._counts = np.bincount(self._owner[self.needed], minlength=self._comm.size)
        wanted: Sequence[np.ndarray] = self._comm.alltoall(np.split(self.needed, np.cumsum(self._counts)[:-1]))
        self.asked = np.concatenate(wanted)
        self._asked_counts = np.array([len(part) for part in wanted])
        self._exists = bool(self._comm.allreduce(len(self.needed) > 0, op=MPI.LOR))

    def fetch(self, *arrays: np.ndarray) -> None:
        """Bring the needed rows of arrays (rows, n) from their owners, in one message; collective."""
        if not self._exists:
            return
        together = np.concatenate([values[self.asked] for values in arrays], axis=1)
        received = self._sent(together, self._asked_counts, self._counts)
        for values, part in zip(
            arrays, np.split(received, np.cumsum([a.shape[1] for a in arrays])[:-1], axis=1), strict=True
        ):
            values[self.needed] = part

    def give(self, sums: np.ndarray) -> None:
        """Add what this rank has in the needed rows of `sums` (rows, n) to their owners' rows; collective.

        Terms are added in the order of the ranks; where that must not matter, sums have to be exact.
        """
        if self._exists:
            np.add.at(sums, self.asked, self._sent(sums[self.needed], self._counts, self._asked_counts))

    def _sent(self, values: np.ndarray, counts: np.ndarray, expected: np.ndarray) -> np.ndarray:
        width = values.shape[1]
        received = np.empty((int(expected.sum()), width))
        self._comm.Alltoallv([values, width * counts, MPI.DOUBLE], [received, width * expected, MPI.DOUBLE])
        return received
