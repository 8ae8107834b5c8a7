"""Faces of hexahedra, their area vectors, and the order of nodes.

Within the program a hexahedron's nodes are in tensor-product order, as in dolfinx: node n lies at xi = 1 where bit 0 of
n is set, eta by bit 1, zeta by bit 2. Files hold VTK's order.
"""

from __future__ import annotations

import numpy as np

FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [1, 3, 7, 5], [3, 2, 6, 7], [2, 0, 4, 6]])
"""Nodes of a hexahedron's faces, normals outward."""

_TENSOR_ORDER = [0, 1, 3, 2, 4, 5, 7, 6]


def reordered(cells: np.ndarray) -> np.ndarray:
    """Hexahedra (cells, 8) in VTK order from those in tensor-product order, or the reverse; others as they are."""
    return cells[:, _TENSOR_ORDER] if cells.shape[1] == len(_TENSOR_ORDER) else cells


def area_vectors(corner: np.ndarray) -> np.ndarray:
    """Area vectors (faces, 3) in m2 of quadrilaterals with corners (faces, 4, 3) in m, outward where their order is."""
    vectors: np.ndarray = 0.5 * np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    return vectors
