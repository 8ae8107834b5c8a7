"""A hexahedral mesh handed to dolfinx and spread over the ranks."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np

from burst_fenicsx import compat
from burst_fenicsx.meshing.mesh import cell_centres
from burst_fenicsx.meshing.placement import to_local
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from mpi4py import MPI
    from numpy.typing import NDArray

    from burst_fenicsx.meshing.mesh import HexahedralMesh
    from burst_fenicsx.problem import Round


_COST_OF_CHARGE = 0.8  # of a casing's cell and step: the kernels' times in benchmarks/README.md
_SAME_AZIMUTH = 1e-6  # rad; of layers that lie behind each other
_MOST_SPREAD = 2.0  # of the span of a cell's nodes over that in dolfinx's order: beyond it dolfinx's is taken


@dataclass(frozen=True)
class DistributedMesh:
    """One rank's share of a mesh, its cells and nodes in the order of the mesh that was given.

    Rows of cells and nodes follow each other there, so that neighbours lie side by side in memory: in dolfinx's own
    order a pair of rounds takes 18 % longer. The nodes of the geometry and the degrees of freedom of all spaces are
    numbered so; the cells and vertices of the topology keep dolfinx's numbers. Nodes that ranks share do as well.

    Attributes
    ----------
    domain : the dolfinx mesh; its geometry's nodes are numbered as here.
    dofmap : (owned cells, 8) int32 local nodes.
    cell, node : (owned cells,) and (local nodes,) int64: numbers in the mesh that was given.
    row : (all cells,) int32: which cell here each of dolfinx's is.
    owned_nodes : how many of the local nodes this rank owns (they come first).
    part, round, segment : (owned cells,) int32; station : (owned cells,) m from the nose end.
    all_dofmap, all_cell, all_part, all_round : the same of owned and ghost cells, ghosts last. The ghosts are the other
        ranks' cells that touch a place (a node or its twin) which a cell of this rank touches.
    """

    domain: Any
    dofmap: np.ndarray
    cell: np.ndarray
    node: np.ndarray
    row: np.ndarray
    owned_nodes: int
    part: np.ndarray
    round: np.ndarray
    segment: np.ndarray
    station: np.ndarray
    all_dofmap: np.ndarray
    all_cell: np.ndarray
    all_part: np.ndarray
    all_round: np.ndarray

    @property
    def comm(self) -> MPI.Comm:
        """Communicator of the mesh."""
        return self.domain.comm

    @property
    def cells(self) -> int:
        """Cells that this rank owns."""
        return len(self.dofmap)

    @cached_property
    def vector_space(self) -> Any:  # noqa: ANN401 - dolfinx's class
        """Vector-valued trilinear functions; their degrees of freedom are numbered as the nodes."""
        space, dofmap = compat.vector_space(self.domain), compat.geometry_dofmap(self.domain)
        return compat.renumbered_space(space, self.domain.geometry.index_map(), dofmap)

    def cell_space(self, size: int = 1, points: int = 1) -> Any:  # noqa: ANN401
        """Functions of `size` components, constant in each cell or known at its points, numbered as the cells here."""
        if (size, points) in self._cell_spaces:
            return self._cell_spaces[size, points]
        make = compat.cell_space if points == 1 else compat.quadrature_space
        topology = self.domain.topology
        index_map = compat.renumbered_map(self.comm, topology.index_map(topology.dim), self.row, points)
        dofmap = points * self.row[:, None] + np.arange(points, dtype=np.int32)
        space = compat.renumbered_space(make(self.domain, size), index_map, dofmap)
        self._cell_spaces[size, points] = space
        return space

    @cached_property
    def _cell_spaces(self) -> dict[tuple[int, int], Any]:
        return {}

    def local_node(self, numbers: np.ndarray) -> np.ndarray:
        """Local nodes (int32) of nodes of the mesh that was given, in the shape of `numbers`; -1 where absent."""
        table = self._local_nodes
        known = np.greater_equal(numbers, 0) & np.less(numbers, len(table))
        return np.where(known, table[np.where(known, numbers, 0)], np.int32(-1))

    @cached_property
    def _local_nodes(self) -> np.ndarray:
        """Local node by number in the mesh that was given, up to the largest that this rank has; -1 where absent."""
        table = np.full(int(self.node.max(initial=0)) + 1, -1, dtype=np.int32)
        table[self.node] = np.arange(len(self.node), dtype=np.int32)
        return table

    def gather_cells(self, values: np.ndarray) -> np.ndarray | None:
        """Values of all cells in the order of the mesh that was given, on rank 0; None elsewhere."""
        return gather_rows(self.comm, self.cell, values[: self.cells])

    def gather_nodes(self, values: np.ndarray) -> np.ndarray | None:
        """Values of all nodes in the order of the mesh that was given, on rank 0; None elsewhere."""
        return gather_rows(self.comm, self.node[: self.owned_nodes], values[: self.owned_nodes])

    def all_cells(self, values: np.ndarray) -> np.ndarray:
        """As `gather_cells`, on every rank."""
        return gather_rows(self.comm, self.cell, values[: self.cells], everywhere=True)

    def cell_sums(self, values: np.ndarray) -> np.ndarray:
        """Sums over all cells (...) of this rank's values (cells, ...), on every rank; collective.

        They are taken in the order of the mesh that was given: the same to the last bit on any number of ranks.
        """
        return _sums(self.all_cells(values))

    def node_sums(self, values: np.ndarray) -> np.ndarray:
        """Sums over all nodes, as `cell_sums`; `values` (local nodes, ...)."""
        own = self.owned_nodes
        return _sums(gather_rows(self.comm, self.node[:own], values[:own], everywhere=True))


def _sums(values: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(values.T).sum(axis=-1)  # column by column: numpy sums pairwise along them


def distribute(
    comm: MPI.Comm, mesh: HexahedralMesh | None, *, destination: np.ndarray | None = None
) -> DistributedMesh:
    """Spread a mesh over the ranks.

    Parameters
    ----------
    comm : communicator.
    mesh : the mesh on rank 0, None elsewhere.
    destination : (cells,) int32, rank of every cell, on rank 0; left out: runs of cells, for a round slabs across its
        axis.
    """
    if comm.rank == 0:
        assert mesh is not None
        count = len(mesh.cells)
        cells, nodes = mesh.cells, mesh.nodes
        if destination is None:
            destination = (np.arange(count, dtype=np.int64) * comm.size // max(count, 1)).astype(np.int32)
        names = (mesh.part, mesh.round, mesh.segment, mesh.station)
        interface_pairs = mesh.interface_pairs
    else:
        cells, nodes = np.zeros((0, 8), dtype=np.int64), np.zeros((0, 3))
        destination = np.zeros(0, dtype=np.int32)
        names, interface_pairs = None, None
    domain = compat.create_hexahedral_mesh(comm, cells, nodes, destination, interface_pairs)
    part, of_round, segment, station = comm.bcast(names, root=0)
    topology = domain.topology
    owned = int(topology.index_map(topology.dim).size_local)
    owned_nodes = int(domain.geometry.index_map().size_local)
    all_cell = np.asarray(topology.original_cell_index, dtype=np.int64)
    node = np.asarray(domain.geometry.input_global_indices, dtype=np.int64)
    row = _as_given(all_cell, np.arange(owned))
    number = _as_given(node, np.flatnonzero(~compat.shared_nodes(domain)))
    dofmap = compat.geometry_dofmap(domain)
    if _span(number[dofmap]) > _MOST_SPREAD * _span(dofmap):
        # Numbered at random, as a mesh file may be: dolfinx has put neighbours next to each other.
        row, number = np.arange(len(all_cell)), np.arange(len(node))
    domain = compat.renumber_nodes(domain, number)
    given = np.argsort(row)
    node, all_cell, all_dofmap = node[np.argsort(number)], all_cell[given], compat.geometry_dofmap(domain)[given]
    cell = all_cell[:owned]
    return DistributedMesh(
        domain=domain,
        dofmap=all_dofmap[:owned],
        cell=cell,
        node=node,
        row=row.astype(np.int32),
        owned_nodes=owned_nodes,
        part=part[cell],
        round=of_round[cell],
        segment=segment[cell],
        station=station[cell],
        all_dofmap=all_dofmap,
        all_cell=all_cell,
        all_part=part[all_cell],
        all_round=of_round[all_cell],
    )


def _as_given(number: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Local numbers by which `own` items lie in the order of the numbers given, in the places of all of them.

    The others keep theirs: ghosts, and nodes that are ghosts elsewhere, whose numbers other ranks know.
    """
    place = np.arange(len(number))
    place[own[np.argsort(number[own])]] = own
    return place


def _span(dofmap: np.ndarray) -> float:
    """How far apart the numbers of a cell's nodes lie, median over the cells: pairs at split faces have far numbers."""
    return float(np.median(dofmap.max(axis=1) - dofmap.min(axis=1))) if len(dofmap) else 0.0


@overload
def gather_rows(comm: MPI.Comm, places: np.ndarray, values: np.ndarray, *, everywhere: Literal[True]) -> np.ndarray: ...
@overload
def gather_rows(comm: MPI.Comm, places: np.ndarray, values: np.ndarray) -> np.ndarray | None: ...
def gather_rows(
    comm: MPI.Comm, places: np.ndarray, values: np.ndarray, *, everywhere: bool = False
) -> np.ndarray | None:
    """Rows of all ranks at their places in the whole, on rank 0, or everywhere; None elsewhere. Collective."""
    if comm.size == 1:
        result = np.empty(values.shape, dtype=values.dtype)
        result[places] = values
        return result
    pieces = comm.allgather((places, values)) if everywhere else comm.gather((places, values), root=0)
    if pieces is None:
        return None
    total = sum(len(where) for where, _ in pieces)
    result = np.empty((total, *values.shape[1:]), dtype=values.dtype)
    for where, what in pieces:
        result[where] = what
    return result


def partition(mesh: HexahedralMesh, rounds: Sequence[Round], ranks: int) -> NDArray[np.int32]:
    """Rank of every cell (cells,): equal costs in the order of rounds, azimuths and stations.

    Cells near the front take the shortest steps, and all ranks wait for the slowest in each of them: of slabs across
    the axis those with the front work while the others wait. Sectors have the same share of every layer, of charge and
    casing, and so of every level of local time stepping, at any time.

    With as many ranks as rounds or fewer, ranks have whole rounds as far as they are alike; with more, sectors; with
    more than there are cells around, pieces of sectors along the axis.

    Parameters
    ----------
    mesh : all cells. rounds : in order; where they stand. ranks : how many there are.
    """
    azimuth = np.zeros(len(mesh.cells))
    centres = cell_centres(mesh)
    for index, item in enumerate(rounds):
        own = mesh.round == index
        local = to_local(centres[own], item.position, item.axis)
        azimuth[own] = np.round(np.arctan2(local[:, 1], local[:, 0]) / _SAME_AZIMUTH)
    order = np.lexsort((mesh.station, azimuth, mesh.round))
    cost = np.where(mesh.part == Part.CHARGE, _COST_OF_CHARGE, 1.0)[order]
    # A cell belongs to the share in which its middle lies.
    reached = np.cumsum(cost) - 0.5 * cost
    owner = np.empty(len(order), dtype=np.int32)
    owner[order] = np.minimum(reached / cost.sum() * ranks, ranks - 1)
    return owner
