"""The surfaces that may touch: outsides of casings and charges, found once on the whole mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.meshing.faces import boundary_faces
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.meshing import HexahedralMesh

__all__ = ["ContactSurfaces", "contact_surfaces"]


@dataclass(frozen=True)
class ContactSurfaces:
    """Faces and nodes of all bodies; a body is the casing with its fuze, or the charge, of one round.

    Where charge and casing share their nodes, a round is one body.

    Attributes
    ----------
    node : (surface nodes,) int64, ascending: numbers in the whole mesh.
    faces : (faces, 4) int32, rows of `node`, in outward order.
    face_body, node_body : int32, twice the round, plus one for a charge.
    edge : (faces,) m, square root of the initial area.
    outside : (surface nodes,) bool, nodes on the outside of a whole round: those that may meet others from the start.
    """

    node: np.ndarray
    faces: np.ndarray
    face_body: np.ndarray
    node_body: np.ndarray
    edge: np.ndarray
    outside: np.ndarray


def contact_surfaces(mesh: HexahedralMesh) -> ContactSurfaces:
    """Find the surfaces of all bodies of the whole mesh."""
    split = len(mesh.twins) > 0
    body = 2 * mesh.round.astype(np.int64)
    if split:
        body += mesh.part == Part.CHARGE
    merged = np.arange(len(mesh.nodes))
    merged[mesh.twins[:, 0]] = mesh.twins[:, 1]
    outer, _ = boundary_faces(merged[mesh.cells])
    outside = np.zeros(len(mesh.nodes), dtype=bool)
    outside[outer] = True
    outside[mesh.twins[:, 0]] &= outside[mesh.twins[:, 1]]

    faces, bodies = [], []
    for number in np.unique(body):
        found, _ = boundary_faces(mesh.cells[body == number])
        faces.append(found)
        bodies.append(np.full(len(found), number, dtype=np.int32))
    all_faces = np.concatenate(faces)
    node, rows = np.unique(all_faces, return_inverse=True)
    numbered = rows.reshape(-1, 4).astype(np.int32)
    face_body = np.concatenate(bodies)
    node_body = np.zeros(len(node), dtype=np.int32)
    for corner in range(4):
        node_body[numbered[:, corner]] = face_body
    at = mesh.nodes[all_faces]
    area = 0.5 * np.linalg.norm(np.cross(at[:, 2] - at[:, 0], at[:, 3] - at[:, 1]), axis=1)
    return ContactSurfaces(node, numbered, face_body, node_body, np.sqrt(area), outside[node])
