"""Faces on the outside of groups of hexahedra, and quadrilaterals that share an edge."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.geometry.faces import FACES

if TYPE_CHECKING:
    from burst_fenicsx.meshing.mesh import HexahedralMesh

__all__ = ["across_edges", "outer_faces", "shared_edges"]


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
