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
from burst_fenicsx.meshing.mesh import across_edges, outer_faces, shared_edges
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
    joined = coo_matrix((np.ones(len(one)), (one // 4, other // 4)), shape=(len(faces), len(faces)))
    _, surface = connected_components(joined, directed=False)
    free = ~covered & np.isin(surface, surface[covered])
    order = np.concatenate([np.flatnonzero(covered), np.flatnonzero(free)])
    return faces[order], cell[order], int(covered.sum())


def _smooth_edges(nodes: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pairs of edges, as of `shared_edges`, at which the surface is smooth."""
    one, other = shared_edges(faces)
    normal = area_vectors(nodes[faces])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    smooth = np.einsum("ij,ij->i", normal[one // 4], normal[other // 4]) > SMOOTH
    return one[smooth], other[smooth]


def smooth_surface(nodes: np.ndarray, faces: np.ndarray) -> tuple[SlideSurface, np.ndarray]:
    """The faces with their smooth groups around each node, and the row of each group's node.

    Corners at a node are of one group where smooth edges lead from one of their faces to the other. Groups are numbered
    by the rows of their nodes, then by their first faces.
    """
    one, other = _smooth_edges(nodes, faces)
    # The faces of an edge run along it in opposite directions.
    ends = np.concatenate([one, _next_corner(one)]), np.concatenate([_next_corner(other), other])
    joined = coo_matrix((np.ones(len(ends[0])), ends), shape=(faces.size, faces.size))
    groups, label = connected_components(joined, directed=False)
    _, first_corner = np.unique(label, return_index=True)
    number = np.empty(groups, dtype=np.int32)
    number[np.lexsort((first_corner, faces.ravel()[first_corner]))] = np.arange(groups, dtype=np.int32)
    corner_group = number[label].reshape(faces.shape)
    order = np.argsort(corner_group.ravel(), kind="stable")
    first_face = np.concatenate([[0], np.cumsum(np.bincount(number[label], minlength=groups))]).astype(np.int32)
    surface = SlideSurface(
        faces=faces.astype(np.int32),
        neighbour=across_edges(corner_group),  # where the surface is smooth: both ends are of one group
        corner=corner_group,
        first_face=first_face,
        face=(order // 4).astype(np.int32),
        known=np.ones(len(faces), dtype=bool),
        vector=np.zeros((groups, 3)),
    )
    return surface, faces.ravel()[order[first_face[:-1]]].astype(np.int32)


def _next_corner(corner: np.ndarray) -> np.ndarray:
    """The next corner of the same face; corners are numbered face by face."""
    following: np.ndarray = corner - corner % 4 + (corner + 1) % 4
    return following


def make_contacts(
    surface: SlideSurface,
    group_row: np.ndarray,
    slave: np.ndarray,
    mine: np.ndarray,
    strength: np.ndarray,
    cells: np.ndarray,
    rows: int,
) -> SlideContacts:
    """A contact for each group, in the corner where charge and casing coincide; arguments as its fields."""
    count = len(group_row)
    face = surface.face[surface.first_face[:-1]]
    corner = np.argmax(surface.corner[face] == np.arange(count)[:, None], axis=1)
    signs = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    return SlideContacts(
        contact=mine,
        slave=slave,
        row=group_row,
        of_node=np.bincount(group_row)[group_row].astype(float),
        cells=cells,
        strength=strength,
        area=np.zeros((count, 3)),
        face=face.astype(np.int32),
        point=signs[corner],
        bonded=np.ones(count, dtype=np.int8),
        gap=np.zeros(count),
        stiffness=np.zeros(count),
        slip=np.zeros((count, 3)),
        weight=np.zeros((count, 4)),
        force=np.zeros((count, 3)),
        off=np.zeros(count, dtype=np.int8),
        tally=np.zeros((count, 3)),
        load=np.zeros(rows),
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
