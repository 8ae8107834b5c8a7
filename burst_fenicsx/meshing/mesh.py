"""The hexahedral mesh that every stage of the burst starts from: arrays only."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, TypeVar

import numpy as np

from burst_fenicsx.errors import InputError
from burst_fenicsx.kernels.geometry.faces import FACES
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Segment


_Mesh = TypeVar("_Mesh", bound="CellMesh")


@dataclass(frozen=True)
class CellMesh(ABC):
    """Cells of one or more rounds with their names: what hexahedra and quadrilaterals of a meridian share.

    Attributes
    ----------
    nodes : (n, 3) coordinates (m).
    cells : nodes of the cells: (m, 8) of hexahedra in tensor-product order, (m, 4) of quadrilaterals counter-clockwise.
    part : (m,) `Part` of each cell.
    round : (m,) index of the round of each cell.
    segment : (m,) index into that round's segments; -1 for charge and fuze.
    station : (m,) axial station of the cell's centre, from the nose end (m).
    segments : the segments of each round.
    lengths : the length of each round (m).
    interface_pairs : (pairs, 2) nodes in the same place on both sides of a split face: the charge's, the other part's.
    held : (n,) where rounds are cut at planes of symmetry: bit k is set for the nodes in plane k. None: nothing is cut.
    held_normals : the bits that are used and the unit normals of their planes.
    """

    nodes: NDArray[np.float64]
    cells: NDArray[np.int64]
    part: NDArray[np.int32]
    round: NDArray[np.int32]
    segment: NDArray[np.int32]
    station: NDArray[np.float64]
    segments: tuple[tuple[Segment, ...], ...] = ()
    lengths: tuple[float, ...] = ()
    interface_pairs: NDArray[np.int64] = field(default_factory=lambda: np.zeros((0, 2), dtype=np.int64))
    held: NDArray[np.uint8] | None = None
    held_normals: tuple[tuple[int, tuple[float, float, float]], ...] = ()

    @property
    def node_weight(self) -> NDArray[np.float64]:
        """Share of each node (nodes,) that belongs to the mesh: a half in a plane that cuts its round, else 1."""
        if self.held is None:
            return np.ones(len(self.nodes))
        weights: NDArray[np.float64] = 0.5 ** np.unpackbits(self.held[:, None], axis=1).sum(axis=1)
        return weights

    @property
    @abstractmethod
    def volumes(self) -> NDArray[np.float64]:
        """Volumes of the cells (m,) in m3."""

    @property
    @abstractmethod
    def mean_edge(self) -> float:
        """Edge of the mean cell (m)."""

    @property
    def shortest_edge(self) -> float:
        """Shortest edge (m)."""
        return float(edge_lengths(self)[0].min())

    @property
    def places(self) -> NDArray[np.int64]:
        """One number for each place (nodes,): a charge's node is named by its twin."""
        place = np.arange(len(self.nodes), dtype=np.int64)
        place[self.interface_pairs[:, 0]] = self.interface_pairs[:, 1]
        return place


@dataclass(frozen=True)
class HexahedralMesh(CellMesh):
    """Linear hexahedra of one or more rounds in world coordinates, see `CellMesh`.

    Nodes and cells are numbered layer by layer from nose to base, round after round. No node is unused. Parts share
    their nodes unless `split_charges` has parted them; rounds do not.
    """

    @property
    def volumes(self) -> NDArray[np.float64]:
        """Exact volumes of the trilinear cells (m,) in m3."""
        return cell_volumes(self)

    @property
    def mean_edge(self) -> float:
        """Edge of the mean cell (m)."""
        return float(self.volumes.mean() ** (1.0 / 3.0))

    @cached_property
    def neighbours(self) -> NDArray[np.int32]:
        """The cell behind each of a cell's faces (cells, 6), across splits too; -1 where there is none.

        Behind a plane of symmetry lies a cell's own image: there the cell itself is named.
        """
        a, b, c, d = np.sort(self.places[self.cells][:, FACES], axis=2).reshape(-1, 4).T
        first, second = a * len(self.nodes) + b, c * len(self.nodes) + d
        order = np.lexsort((second, first))
        same = (first[order[1:]] == first[order[:-1]]) & (second[order[1:]] == second[order[:-1]])
        one, other = order[:-1][same], order[1:][same]
        found = np.full(6 * len(self.cells), -1, dtype=np.int32)
        found[one], found[other] = other // 6, one // 6
        found = found.reshape(-1, 6)
        if self.held is not None:
            cell, side = np.nonzero(found < 0)
            corners = self.held[self.cells[cell[:, None], FACES[side]]]
            in_plane = np.bitwise_and.reduce(corners, axis=1) != 0
            found[cell[in_plane], side[in_plane]] = cell[in_plane]
        return found


def merge(meshes: Sequence[_Mesh]) -> _Mesh:
    """Put meshes of different rounds into one; nodes are not joined.

    The meshes must carry consecutive round indices in their order (mesh i holds round i).

    Raises
    ------
    InputError
        No mesh is given, or a round index occurs twice or out of order.
    """
    if not meshes:
        raise InputError("merge: no mesh is given")
    seen = [int(index) for mesh in meshes for index in np.unique(mesh.round)]
    if seen != list(range(len(seen))):
        raise InputError(f"merge: the meshes carry the round indices {seen}; 0, 1, 2, ... in this order are expected")
    offsets = np.cumsum([0, *(len(mesh.nodes) for mesh in meshes[:-1])])
    return replace(
        meshes[0],
        nodes=np.concatenate([mesh.nodes for mesh in meshes]),
        cells=np.concatenate([mesh.cells + offset for mesh, offset in zip(meshes, offsets, strict=True)]),
        part=np.concatenate([mesh.part for mesh in meshes]),
        round=np.concatenate([mesh.round for mesh in meshes]),
        segment=np.concatenate([mesh.segment for mesh in meshes]),
        station=np.concatenate([mesh.station for mesh in meshes]),
        segments=tuple(segments for mesh in meshes for segments in mesh.segments),
        lengths=tuple(length for mesh in meshes for length in mesh.lengths),
        interface_pairs=np.concatenate(
            [mesh.interface_pairs + offset for mesh, offset in zip(meshes, offsets, strict=True)]
        ),
        held=_merged_held(meshes),
        held_normals=tuple(sorted({one for mesh in meshes for one in mesh.held_normals})),
    )


def _merged_held(meshes: Sequence[CellMesh]) -> NDArray[np.uint8] | None:
    if all(mesh.held is None for mesh in meshes):
        return None
    return np.concatenate(
        [np.zeros(len(mesh.nodes), dtype=np.uint8) if mesh.held is None else mesh.held for mesh in meshes]
    )


def cell_centres(mesh: HexahedralMesh) -> NDArray[np.float64]:
    """Return the mean of each cell's corners (m), shape (m, 3)."""
    centre = mesh.nodes[mesh.cells[:, 0]].copy()
    for corner in range(1, 8):
        centre += mesh.nodes[mesh.cells[:, corner]]
    return centre / 8.0


def cell_volumes(mesh: HexahedralMesh) -> NDArray[np.float64]:
    """Return the exact volume of each trilinear cell (m3), shape (m,)."""
    from burst_fenicsx.kernels.cells.hexahedron import hexahedron_volumes

    volumes: NDArray[np.float64] = hexahedron_volumes(np.ascontiguousarray(mesh.nodes), mesh.cells.astype(np.int32))
    return volumes


def part_volumes(mesh: CellMesh) -> dict[Part, float]:
    """Return the mesh's volume of each part that it has (m3)."""
    totals = np.bincount(mesh.part, weights=mesh.volumes, minlength=len(Part))
    return {part: float(totals[part]) for part in Part if np.any(mesh.part == part)}


def outer_faces(mesh: HexahedralMesh, group: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Faces behind which lies no cell of the same group, in the order of the cells.

    Parameters
    ----------
    mesh : the mesh; coincident nodes on both sides of a split are one place.
    group : (cells,) number of each cell's group; cells of a negative group have no faces.

    Returns
    -------
    Nodes (faces, 4) with outward order, the cell of each face, and the cell behind it or -1.
    """
    neighbours = mesh.neighbours
    outside = (neighbours < 0) | (group[neighbours] != group[:, None])
    outside[group < 0] = False
    cell, side = np.nonzero(outside)
    return mesh.cells[cell[:, None], FACES[side]], cell, neighbours[cell, side]


def shared_edges(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of edges, each 4 times its face plus the number of its first corner, with the same two ends."""
    ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=1)
    return order[:-1][same], order[1:][same]


def across_edges(corners: np.ndarray) -> np.ndarray:
    """The quadrilateral across each edge of others (faces, 4) int32, which has the same two ends there; else -1."""
    one, other = shared_edges(corners)
    found = np.full(corners.size, -1, dtype=np.int32)
    found[one], found[other] = other // 4, one // 4
    return found.reshape(corners.shape)


def edge_lengths(mesh: CellMesh) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Each cell's shortest and longest edge (m), shapes (m,)."""
    corners = mesh.nodes[mesh.cells]
    ends = [(n, (n + 1) % 4) for n in range(4)]
    if corners.shape[1] == 8:
        ends = [(n, n | bit) for bit in (1, 2, 4) for n in range(8) if not n & bit]
    lengths = np.stack([np.linalg.norm(corners[:, b] - corners[:, a], axis=1) for a, b in ends])
    return lengths.min(axis=0), lengths.max(axis=0)
