"""The surfaces that may touch: those of casings, and what lies within casings; found once on the whole mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.geometry.faces import FACES, area_vectors
from burst_fenicsx.meshing.mesh import outer_faces
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.meshing import HexahedralMesh

__all__ = ["ContactSurfaces", "contact_surfaces", "outward_sides"]


@dataclass(frozen=True)
class ContactSurfaces:
    """Faces and nodes of all bodies: each round's casing with its fuze, and with its charge where they share nodes.

    Where there are several rounds, the interior nodes
    of the casings are among the nodes: they overtake a surface layer that folds, and then meet other rounds' faces.

    Attributes
    ----------
    node : (surface nodes,) int64, ascending: numbers in the whole mesh, of nodes on faces and of interior ones.
    faces : (faces, 4) int32, rows of `node`, in outward order.
    face_body, node_body : int32, twice the round.
    cell : (faces,) int64, number in the whole mesh of the cell that each face belongs to.
    edge : (faces,) m, square root of the initial area.
    outside : (surface nodes,) bool, nodes on the outside of a whole round: those that may meet others from the start.
    interior : (surface nodes,) bool, nodes of a casing that lie on no face: they meet faces of other rounds only.
    on_surface : how many of the faces, the first, lie on a surface. The others lie within casings, between layers of
        cells counted from the outside, and look outward: nodes of other rounds meet them where outer cells fold.
    held, held_normals : (surface nodes,) uint8 and planes of symmetry, as the mesh has them.
    """

    node: np.ndarray
    faces: np.ndarray
    face_body: np.ndarray
    node_body: np.ndarray
    cell: np.ndarray
    edge: np.ndarray
    outside: np.ndarray
    interior: np.ndarray
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
    """Find the surfaces of all bodies of the whole mesh."""
    split = len(mesh.twins) > 0
    body = 2 * mesh.round.astype(np.int64)
    # A charge of its own nodes stays within its casing, see `sliding`; one of shared nodes is part of the round.
    found, cell, behind = outer_faces(mesh, np.where(split & (mesh.part == Part.CHARGE), -1, body))
    outside = np.zeros(len(mesh.nodes), dtype=bool)
    outside[found[behind < 0]] = True

    order = np.argsort(body[cell], kind="stable")
    all_faces, face_body = found[order], body[cell[order]].astype(np.int32)
    on_face = np.zeros(len(mesh.nodes), dtype=bool)
    on_face[all_faces] = True
    used = on_face.copy()
    solid = mesh.part != Part.CHARGE
    layers, of_layers = np.zeros((0, 4), dtype=np.int64), np.zeros(0, dtype=np.int64)
    if len(np.unique(mesh.round)) > 1:
        used[mesh.cells[solid]] = True
        layers, of_layers = _faces_of_layers(mesh, solid)
    node = np.flatnonzero(used)
    numbered = (np.cumsum(used, dtype=np.int32) - 1)[np.concatenate([all_faces, layers])]
    of_node = np.zeros(len(mesh.nodes), dtype=np.int32)
    for corner in range(8):
        of_node[mesh.cells[solid, corner]] = 2 * mesh.round[solid]
    node_body = of_node[node]
    for corner in range(4):
        node_body[numbered[: len(all_faces), corner]] = face_body
    face_body = np.concatenate([face_body, (2 * mesh.round[of_layers]).astype(np.int32)])
    at = mesh.nodes[node][numbered]
    area = np.linalg.norm(area_vectors(at), axis=1)
    return ContactSurfaces(
        node,
        numbered,
        face_body,
        node_body,
        np.concatenate([cell[order], of_layers]),
        np.sqrt(area),
        outside[node],
        ~on_face[node],
        len(all_faces),
        np.zeros(len(node), dtype=np.uint8) if mesh.held is None else mesh.held[node],
        mesh.held_normals,
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


def _faces_of_layers(mesh: HexahedralMesh, solid: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces between the layers of the casings' cells, and the cells that they belong to.

    `solid` (cells,) names the cells of casings. Returns nodes (faces, 4), in the order that looks outward, and (faces,)
    int64.
    """
    cell, side = np.nonzero(outward_sides(mesh) & (mesh.neighbours >= 0) & solid[:, None])
    return mesh.cells[cell[:, None], FACES[side]], cell
