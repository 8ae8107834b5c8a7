"""The surfaces that may touch: those of casings, and what lies within casings; found once on the whole mesh."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.geometry.faces import FACES, area_vectors
from burst_fenicsx.meshing.mesh import outer_faces
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.meshing import HexahedralMesh


@dataclass(frozen=True)
class ContactSurfaces:
    """Faces and nodes of all rounds: each one's casing with its fuze, and with its charge where they share nodes.

    Where there are several rounds, the interior nodes
    of the casings are among the nodes: they overtake a surface layer that folds, and then meet other rounds' faces.

    Attributes
    ----------
    node : (surface nodes,) int64, ascending: numbers in the whole mesh, of nodes on faces and of interior ones.
    faces : (faces, 4) int32, rows of `node`, in outward order.
    face_round, node_round : int32.
    cell : (faces,) int64, number in the whole mesh of the cell that each face belongs to.
    edge : (faces,) m, square root of the initial area.
    outside : (surface nodes,) bool, nodes on the outside of a whole round: those that may meet others from the start.
    interior : (surface nodes,) bool, nodes of a casing that lie on no face.
    inner : (surface nodes,) bool, these and those of the bore, where there are several rounds: they meet faces of
        other rounds only.
    on_surface : how many of the faces, the first, lie on a surface. The others lie within casings, between layers of
        cells counted from the outside, and look outward: nodes of other rounds meet them where outer cells fold.
    held, held_normals : (surface nodes,) uint8 and planes of symmetry, as the mesh has them.
    """

    node: np.ndarray
    faces: np.ndarray
    face_round: np.ndarray
    node_round: np.ndarray
    cell: np.ndarray
    edge: np.ndarray
    outside: np.ndarray
    interior: np.ndarray
    inner: np.ndarray
    on_surface: int
    held: np.ndarray
    held_normals: tuple[tuple[int, tuple[float, float, float]], ...] = ()

    def flatten(self, vectors: np.ndarray) -> None:
        """Take from vectors (surface nodes, 3) what points out of the planes in which nodes are held.

        Faces of one side alone are summed at a plane of symmetry; with those of the image their sum lies in it.
        """
        for bit, normal in self.held_normals:
            rows = np.flatnonzero(self.held >> bit & 1)
            vectors[rows] -= (vectors[rows] @ np.asarray(normal))[:, None] * np.asarray(normal)


def contact_surfaces(mesh: HexahedralMesh) -> ContactSurfaces:
    """Find the surfaces of all rounds of the whole mesh."""
    split = len(mesh.interface_pairs) > 0
    # A charge of its own nodes stays within its casing, see `sliding`; one of shared nodes is part of the round.
    faces, cell, behind = outer_faces(mesh, np.where(split & (mesh.part == Part.CHARGE), -1, mesh.round))
    outside, on_face = np.zeros(len(mesh.nodes), dtype=bool), np.zeros(len(mesh.nodes), dtype=bool)
    outside[faces[behind < 0]] = True
    on_face[faces] = True
    order = np.argsort(mesh.round[cell], kind="stable")
    faces, cell, on_surface = faces[order], cell[order], len(faces)
    used, inner = on_face.copy(), np.zeros_like(outside)
    if len(np.unique(mesh.round)) > 1:
        solid = mesh.part != Part.CHARGE
        inner[mesh.cells[solid]] = True
        inner &= ~outside
        used |= inner
        # Those between the layers of the casings' cells, in the order that looks outward.
        of_layers, side = np.nonzero(outward_sides(mesh) & (mesh.neighbours >= 0) & solid[:, None])
        faces = np.concatenate([faces, mesh.cells[of_layers[:, None], FACES[side]]])
        cell = np.concatenate([cell, of_layers])
    node = np.flatnonzero(used)
    of_node = np.zeros(len(mesh.nodes), dtype=np.int32)
    of_node[mesh.cells] = mesh.round[:, None]
    return ContactSurfaces(
        node=node,
        faces=(np.cumsum(used, dtype=np.int32) - 1)[faces],
        face_round=mesh.round[cell].astype(np.int32),
        node_round=of_node[node],
        cell=cell,
        edge=_edges(mesh.nodes[faces]),
        outside=outside[node],
        interior=~on_face[node],
        inner=inner[node],
        on_surface=on_surface,
        held=np.zeros(len(node), dtype=np.uint8) if mesh.held is None else mesh.held[node],
        held_normals=mesh.held_normals,
    )


def outward_sides(mesh: HexahedralMesh) -> np.ndarray:
    """Sides of cells that look outward (cells, 6), bool, as `FACES` has them.

    Those on the outside of a round, those of a charge against its casing, and within a casing those between the layers
    of its cells, which are nested from the outside inward.
    """
    neighbours, solid = mesh.neighbours, mesh.part != Part.CHARGE
    layer = np.where(solid & (neighbours < 0).any(axis=1), 0, -1)
    for depth in range(1, len(layer)):
        behind = np.where(neighbours >= 0, layer[neighbours], -1)
        reached = solid & (layer < 0) & (behind == depth - 1).any(axis=1)
        if not reached.any():
            break
        layer[reached] = depth
    behind = np.where(neighbours >= 0, layer[neighbours], -1)
    between = (layer > 0)[:, None] & (behind == layer[:, None] - 1)
    against: np.ndarray = ~solid[:, None] & (neighbours >= 0) & solid[neighbours]
    return (neighbours < 0) | between | against


def _edges(corners: np.ndarray) -> np.ndarray:
    """Square roots of the areas (faces,) in m of faces with these corners (faces, 4, 3) in m."""
    edges: np.ndarray = np.sqrt(np.linalg.norm(area_vectors(corners), axis=1))
    return edges


class OpenFaces:
    """Adds to the surfaces of several rounds the faces that lie open once cells of their casings are eroded.

    These are the sides of whole cells towards eroded ones that are on no surface yet, and, where an eroded cell lay on
    the charge, the face between both, whose nodes still carry the metal's mass. Like the faces between layers, they are
    met by other rounds' nodes alone: through eroded cells, other rounds' metal meets what lies behind them.

    Parameters
    ----------
    mesh : the whole mesh.
    surfaces : before any metal is eroded.
    """

    def __init__(self, mesh: HexahedralMesh, surfaces: ContactSurfaces) -> None:
        self._mesh, self._surfaces = mesh, surfaces
        self._solid = mesh.part != Part.CHARGE
        self._known = outward_sides(mesh) & self._solid[:, None]
        self._row = np.full(len(mesh.nodes), -1, dtype=np.int32)
        self._row[surfaces.node] = np.arange(len(surfaces.node), dtype=np.int32)

    def opened(self, eroded: np.ndarray) -> ContactSurfaces:
        """The surfaces with the open faces behind all others, whichever cells (cells,) are `eroded`."""
        mesh, known = self._mesh, self._known
        beside = sides_beside(mesh.neighbours, eroded)
        cell, side = np.nonzero(beside & self._solid[:, None] & ~known & ~eroded[:, None])
        nodes = mesh.cells[cell[:, None], FACES[side]]
        charge = ~self._solid & (beside.any(axis=1))
        of_charge, towards = np.nonzero(beside & charge[:, None])
        behind = mesh.neighbours[of_charge, towards]
        back = np.argmax(mesh.neighbours[behind] == of_charge[:, None], axis=1)
        nodes = np.concatenate([nodes, mesh.cells[behind[:, None], FACES[back][:, ::-1]]])
        cell = np.concatenate([cell, of_charge])
        before = self._surfaces
        return replace(
            before,
            faces=np.concatenate([before.faces, self._row[nodes]]),
            face_round=np.concatenate([before.face_round, mesh.round[cell].astype(np.int32)]),
            cell=np.concatenate([before.cell, cell]),
            edge=np.concatenate([before.edge, _edges(mesh.nodes[nodes])]),
        )


def sides_beside(neighbours: np.ndarray, eroded: np.ndarray) -> np.ndarray:
    """Sides of cells (cells, sides), bool, behind which lies an `eroded` cell (cells,)."""
    beside: np.ndarray = (neighbours >= 0) & eroded[np.maximum(neighbours, 0)]
    return beside
