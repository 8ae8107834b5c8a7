"""The surface on which a charge slides: the casing's faces around it, their smooth groups, and a contact for each."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from burst_fenicsx.kernels.constants import SMOOTH
from burst_fenicsx.kernels.contact.slide_points import SlideSurface
from burst_fenicsx.kernels.contact.sliding import SlideContacts
from burst_fenicsx.kernels.geometry.faces import area_vectors
from burst_fenicsx.kernels.geometry.smooth_faces import group_faces
from burst_fenicsx.meshing.mesh import outer_faces
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.meshing import HexahedralMesh

__all__ = ["faces_of", "interface_faces", "make_contacts", "smooth_surface", "widened"]


def interface_faces(mesh: HexahedralMesh) -> tuple[np.ndarray, np.ndarray, int]:
    """Faces of the casing on which a charge may slide, outward from the casing, as nodes (faces, 4), and their cells.

    First those at which a charge lies, whose number is returned as well; then the free ones to which these lead on
    without a crease, such as the wall of a cavity that the charge does not fill, or that behind a fuze.
    """
    faces, cell, behind = outer_faces(mesh, np.where(mesh.part == Part.CASING, 0, -1))
    covered = (behind >= 0) & (mesh.part[behind] == Part.CHARGE)
    one, other = _smooth_edges(mesh.nodes, faces)
    joined = coo_matrix((np.ones(len(one)), (one, other)), shape=(len(faces), len(faces)))
    _, surface = connected_components(joined, directed=False)
    free = ~covered & np.isin(surface, surface[covered])
    order = np.concatenate([np.flatnonzero(covered), np.flatnonzero(free)])
    return faces[order], cell[order], int(covered.sum())


def _normals(nodes: np.ndarray, faces: np.ndarray) -> np.ndarray:
    normal = area_vectors(nodes[faces])
    unit: np.ndarray = normal / np.linalg.norm(normal, axis=1)[:, None]
    return unit


def _smooth_edges(nodes: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The two faces of every edge at which the surface is smooth."""
    one, other = _shared_edges(faces)
    normal = _normals(nodes, faces)
    smooth = np.einsum("ij,ij->i", normal[one // 4], normal[other // 4]) > SMOOTH
    return one[smooth] // 4, other[smooth] // 4


def _shared_edges(corners: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of edges, each 4 times its face plus the number of its first corner, with the same two ends."""
    ends = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=-1).reshape(-1, 2), axis=1)
    order = np.lexsort((ends[:, 1], ends[:, 0]))
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=1)
    return order[:-1][same], order[1:][same]


def smooth_surface(nodes: np.ndarray, faces: np.ndarray, rows: int) -> tuple[SlideSurface, np.ndarray]:
    """The faces with their smooth groups around each node, and the row of each group's node."""
    normal = _normals(nodes, faces)
    first, first_face, face = group_faces(faces, normal, np.arange(rows, dtype=np.int32), rows, SMOOTH)
    groups = len(first_face) - 1
    group_row = np.repeat(np.arange(rows), np.diff(first))
    group_of_entry = np.repeat(np.arange(groups, dtype=np.int32), np.diff(first_face))
    corner_group = np.full(faces.shape, -1, dtype=np.int32)
    place = np.argmax(faces[face] == group_row[group_of_entry][:, None], axis=1)
    corner_group[face, place] = group_of_entry
    surface = SlideSurface(
        faces=faces.astype(np.int32),
        neighbour=_across_edges(corner_group),
        corner=corner_group,
        first_face=first_face,
        face=face,
        known=np.ones(len(faces), dtype=bool),
        vector=np.zeros((groups, 3)),
    )
    return surface, group_row.astype(np.int32)


def _across_edges(corner: np.ndarray) -> np.ndarray:
    """The face across each edge (faces, 4) where the surface is smooth there: both ends are of one group; else -1."""
    one, other = _shared_edges(corner)
    found = np.full(corner.size, -1, dtype=np.int32)
    found[one], found[other] = other // 4, one // 4
    return found.reshape(corner.shape)


def make_contacts(
    surface: SlideSurface, group_row: np.ndarray, slave: np.ndarray, mine: np.ndarray, strength: np.ndarray
) -> SlideContacts:
    """A contact for each group, in the corner where charge and casing coincide."""
    count = len(group_row)
    face = surface.face[surface.first_face[:-1]]
    place = np.argmax(surface.corner[face] == np.arange(count)[:, None], axis=1)
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return SlideContacts(
        contact=mine,
        slave=slave,
        row=group_row,
        share=np.bincount(group_row)[group_row].astype(float),
        strength=strength,
        area=np.zeros((count, 3)),
        face=face.astype(np.int32),
        point=signs[place],
        bonded=np.ones(count, dtype=np.int8),
        gap=np.zeros(count),
        stiffness=np.zeros(count),
        slip=np.zeros((count, 3)),
        weight=np.zeros((count, 4)),
        force=np.zeros((count, 3)),
        off=np.zeros(count, dtype=np.int8),
        tally=np.zeros((count, 3)),
    )


def faces_of(surface: SlideSurface, groups: np.ndarray) -> np.ndarray:
    """Faces of the groups."""
    chosen = np.zeros(len(surface.first_face) - 1, dtype=bool)
    chosen[groups] = True
    return surface.face[np.repeat(chosen, np.diff(surface.first_face))]


def widened(faces: np.ndarray, chosen: np.ndarray, rows: int) -> np.ndarray:
    """The chosen faces and all that share a node with them."""
    touched = np.zeros(rows, dtype=bool)
    touched[faces[chosen]] = True
    return touched[faces].any(axis=1)
