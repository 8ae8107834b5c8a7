"""Faces on the outside of a set of hexahedra."""

from __future__ import annotations

import numpy as np

__all__ = ["boundary_faces"]

# VTK order, outward normals.
_FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])


def boundary_faces(cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Faces that belong to one cell only: nodes (faces, 4) with outward order, and the cell of each (VTK order)."""
    faces = cells[:, _FACES].reshape(-1, 4)
    owner = np.repeat(np.arange(len(cells)), 6)
    key = np.sort(faces, axis=1)
    order = np.lexsort(key.T)
    ranked = key[order]
    same = (ranked[1:] == ranked[:-1]).all(axis=1)
    single = np.ones(len(faces), dtype=bool)
    single[1:] &= ~same
    single[:-1] &= ~same
    keep = np.sort(order[single])
    return faces[keep], owner[keep]
