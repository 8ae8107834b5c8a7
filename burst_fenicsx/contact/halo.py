"""Surface nodes of other ranks that a rank needs: brought from their owners, and forces given back to them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.kernels.vectors.rows import add_to_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Halo"]

_TAG = 17_404


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
        self._needed_from: list[tuple[int, slice]] = []
        self._asked_by: list[tuple[int, slice]] = []

    def need(self, rows: np.ndarray) -> None:
        """Ask for rows from now on, each named once; those of one's own are always there. Collective."""
        if self._comm.size == 1:
            return
        others = rows[self._owner[rows] != self._comm.rank]
        self.needed = others[np.argsort(self._owner[others], kind="stable")].astype(np.int32)
        counts = np.bincount(self._owner[self.needed], minlength=self._comm.size)
        wanted: Sequence[np.ndarray] = self._comm.alltoall(np.split(self.needed, np.cumsum(counts)[:-1]))
        self.asked = np.concatenate(wanted)
        self._needed_from = _parts(counts)
        self._asked_by = _parts(np.array([len(part) for part in wanted]))

    def fetch(self, *arrays: np.ndarray) -> None:
        """Bring the needed rows of arrays (rows, n) from their owners, in one message; of all that share rows."""
        if not self._needed_from and not self._asked_by:
            return
        together = np.concatenate([values[self.asked] for values in arrays], axis=1)
        received = self._sent(together, self._asked_by, self._needed_from)
        for values, part in zip(
            arrays, np.split(received, np.cumsum([a.shape[1] for a in arrays])[:-1], axis=1), strict=True
        ):
            values[self.needed] = part

    def give(self, sums: np.ndarray) -> None:
        """Add what this rank has in the needed rows of `sums` (rows, n) to their owners' rows; of all that share rows.

        Terms are added in the order of the ranks; where that must not matter, sums have to be exact.
        """
        if self._needed_from or self._asked_by:
            add_to_rows(self._sent(sums[self.needed], self._needed_from, self._asked_by), self.asked, sums)

    def _sent(
        self, values: np.ndarray, to: Sequence[tuple[int, slice]], origin: Sequence[tuple[int, slice]]
    ) -> np.ndarray:
        """Send rows `to` ranks and receive others; between those that share rows alone, however many ranks there are.

        Messages of two ranks keep their order, so that exchanges that follow each other do not mix.
        """
        received = np.empty((origin[-1][1].stop if origin else 0, values.shape[1]))
        requests = [self._comm.Irecv(received[rows], source=rank, tag=_TAG) for rank, rows in origin]
        requests += [self._comm.Isend(values[rows], dest=rank, tag=_TAG) for rank, rows in to]
        MPI.Request.Waitall(requests)
        return received


def _parts(counts: np.ndarray) -> list[tuple[int, slice]]:
    """Ranks with any rows, and which they are where rows lie by rank; `counts` (ranks,)."""
    ends = np.cumsum(counts)
    return [(int(rank), slice(int(ends[rank] - counts[rank]), int(ends[rank]))) for rank in np.flatnonzero(counts)]
