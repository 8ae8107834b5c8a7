"""Faces on the outside of groups of hexahedra."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.geometry.faces import FACES

if TYPE_CHECKING:
    from burst_fenicsx.meshing.mesh import HexahedralMesh

__all__ = ["outer_faces"]


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
