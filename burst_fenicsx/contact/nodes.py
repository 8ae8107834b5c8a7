"""The nodes that contact may push, as rows of arrays of its own, and what ranks exchange of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.kernels.contact.pairs import Pairs, Rows, add_pairs, gather_rows, give_rows
from burst_fenicsx.kernels.vectors.exact import quantise, rounding_constant

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.mechanics.fields import BurstFields

CONTACT_FORCES = 2.0**8
"""How much coarser contact's forces are rounded than those of cells: where walls collide, several contacts push one
node, together by more than four times the largest force of a cell, up to which sums of the cells' terms are exact."""

_TAG = 17_406  # of contact's messages
_LARGEST_LOAD = 2.0**10


class ContactNodes:
    """Rows of the nodes of all ranks; each rank keeps its own and those that it needs up to date.

    Parameters
    ----------
    fields : this rank's fields.
    number : nodes of the whole mesh that contact may push, each once, ascending.

    Attributes
    ----------
    rows : the kernels' arrays. own : (k,) int32, rows of this rank's own nodes.
    active : (k,) int32, those of them that may be pushed till `watch` is called again.
    needed : rows of other ranks that this rank needs.
    roundings : constants of `quantise` for forces, loads and work.
    """

    def __init__(self, fields: BurstFields, number: np.ndarray) -> None:
        mesh, count = fields.mesh, len(number)
        self._fields, self._comm = fields, mesh.comm
        self._number = number
        local = mesh.local_node(number).astype(np.int32)
        self.own = np.flatnonzero((local >= 0) & (local < mesh.owned_nodes)).astype(np.int32)
        mass, owner = np.zeros(count), np.zeros(count, dtype=np.int32)
        mass[self.own], owner[self.own] = fields.mass[local[self.own]], self._comm.rank
        if self._comm.size > 1:
            self._comm.Allreduce(MPI.IN_PLACE, mass)
            self._comm.Allreduce(MPI.IN_PLACE, owner)
        self._owner = owner
        zeros = np.zeros
        faster, (position, velocity) = zeros(count, dtype=bool), zeros((2, count, 3))
        self.rows = Rows(local, mass, faster, position, velocity, zeros(count), zeros((count, 4)))
        forces, loads = CONTACT_FORCES * fields.nodes.rounding, rounding_constant(_LARGEST_LOAD)
        self.roundings = forces, loads, fields.grid.rounding
        self.active = self.needed = np.zeros(0, dtype=np.int32)
        self._taken: dict[int, np.ndarray] = {}
        self._lent: dict[int, np.ndarray] = {}

    def rows_of(self, numbers: np.ndarray) -> np.ndarray:
        """Rows (int32) of nodes of the whole mesh, all of which have one."""
        return np.searchsorted(self._number, numbers).astype(np.int32)

    def watch(self, rows: np.ndarray) -> None:
        """Keep these rows up to date from now on, and push no others; collective."""
        comm, rows_now = self._comm, self.rows
        chosen, before = np.zeros((2, len(self._number)), dtype=bool)
        chosen[rows], before[self.active], before[self.needed] = True, True, True
        if comm.size > 1:
            wanted = np.flatnonzero(chosen & (self._owner != comm.rank)).astype(np.int32)
            owner = self._owner[wanted]
            self._taken = {rank: wanted[owner == rank] for rank in np.unique(owner).tolist()}
            asked = comm.alltoall([self._taken.get(rank) for rank in range(comm.size)])
            self._lent = {rank: some for rank, some in enumerate(asked) if some is not None}
            self.needed = wanted
            for some in self._lent.values():
                chosen[some] = True
        active = self.own[chosen[self.own]]
        new, left = active[~before[active]], before & ~chosen
        rows_now.sums[left], rows_now.load[left] = 0.0, 0.0
        nodes = self._fields.nodes
        rows_now.position[new], rows_now.velocity[new] = (
            values[rows_now.local[new]] for values in (nodes.position, nodes.velocity)
        )
        self.active = active

    def set_level(self, level: int) -> None:
        """Contact takes 2^`level` steps in a longest one from now on, and its last one has led here."""
        rows, nodes = self.rows, self._fields.nodes
        rows.faster[self.own] = nodes.finest[rows.local[self.own]] > level
        self.place()

    def place(self) -> None:
        """Take the active nodes to have been where they are now at contact's last step."""
        self.rows.position[self.active] = self._fields.nodes.position[self.rows.local[self.active]]

    def gather(self, step: float) -> float:
        """Take over the nodes' motion in a step (s) and clear the forces; their work (J) in half of it."""
        nodes, grid, rows = self._fields.nodes, self._fields.grid, self.rows
        rows.sums[self.needed] = 0.0
        work: float = gather_rows(self.active, step, nodes.position, nodes.velocity, grid.rounding, rows)
        return work

    def give(self, step: float, fraction: float) -> float:
        """Add a fraction of the forces to those of the nodes; their work (J) in half of the last step (s)."""
        nodes, grid = self._fields.nodes, self._fields.grid
        work: float = give_rows(self.active, step, fraction, grid.rounding, self.rows, nodes.force)
        return work

    def exchange(self, fetched: Sequence[np.ndarray], given: Sequence[np.ndarray]) -> None:
        """Bring needed rows of arrays (rows, n) from their owners, and add those of sums (rows, n) to theirs.

        All in one message to each rank; where the order of the ranks must not matter, sums have to be exact.
        """
        comm = self._comm
        if comm.size == 1:
            return

        def packed(rank: int, lent: bool) -> np.ndarray:
            arrays, by_rank = (fetched, self._lent) if lent else (given, self._taken)
            some = by_rank.get(rank, self.needed[:0])
            return np.concatenate([np.zeros(0), *(array[some].ravel() for array in arrays)])

        ranks = sorted({*self._taken, *self._lent})
        sent = {rank: np.concatenate([packed(rank, True), packed(rank, False)]) for rank in ranks}
        widths = [sum(array.shape[1] for array in arrays) for arrays in (fetched, given)]
        sizes = {
            rank: widths[0] * len(self._taken.get(rank, ())) + widths[1] * len(self._lent.get(rank, ()))
            for rank in ranks
        }
        received = {rank: np.empty(size) for rank, size in sizes.items() if size}
        requests = [comm.Irecv(values, rank, _TAG) for rank, values in received.items()]
        requests += [comm.Isend(values, rank, _TAG) for rank, values in sent.items() if len(values)]
        MPI.Request.Waitall(requests)
        for rank, values in received.items():
            end = 0
            for arrays, by_rank in ((fetched, self._taken), (given, self._lent)):
                some = by_rank.get(rank, self.needed[:0])
                for array in arrays:
                    begin, end = end, end + len(some) * array.shape[1]
                    piece = values[begin:end].reshape(len(some), -1)
                    array[some] = piece if arrays is fetched else array[some] + piece

    @property
    def force(self) -> np.ndarray:
        """Contact's forces (nodes, 3) in N on this rank's own nodes."""
        force = np.zeros_like(self._fields.nodes.force)
        force[self.rows.local[self.active]] = self.rows.sums[self.active, :3]
        return force


class ContactPairs:
    """Pairs of one kind on one rank, whose nodes are its own.

    Parameters
    ----------
    fields : this rank's fields. nodes : contact's rows. pairs : the kernels' arrays.
    facets : (facets, corners) int32 rows.

    Attributes
    ----------
    on_surface : how many pairs, the first, are not of inner nodes.
    watched : (k,) int32 rows that the pairs need, each once or more often.
    friction : J in the last step, exact.
    deepest, deepest_inner : largest penetration now (m), of all pairs and of those of inner nodes.
    """

    def __init__(self, fields: BurstFields, nodes: ContactNodes, pairs: Pairs, facets: np.ndarray) -> None:
        self._fields, self._nodes = fields, nodes
        self.pairs, self.facets = pairs, facets
        self.on_surface = len(pairs.node)
        self.watched = np.zeros(0, dtype=np.int32)
        self.friction = self.deepest = self.deepest_inner = 0.0

    def add(self) -> None:
        """Add the forces that the pairs have found to the rows, and take over friction and depths."""
        self.friction, self.deepest, self.deepest_inner = add_pairs(
            self.pairs, self.facets, self.on_surface, self._nodes.roundings, self._nodes.rows
        )

    @property
    def spring_energy(self) -> float:
        """Energy now in the springs (J), exact."""
        return float(quantise(self.pairs.energies[:, 0], self._fields.grid.rounding).sum())

    def add_forces(self, max_squared_frequency: float, step: float) -> None:
        """Add the forces of springs with at most that squared frequency (1/s2) after a step (s) to the rows."""
        raise NotImplementedError
