"""Quality of the cells, measured on the nodes that the snapshot carries: hexahedra, or quadrilaterals of a meridian."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["aspect_ratio", "scaled_jacobian"]

# Each corner of a VTK hexahedron with the ends of its three edges, in right-handed order.
_CORNERS = (
    (0, 1, 3, 4), (1, 2, 0, 5), (2, 3, 1, 6), (3, 0, 2, 7), (4, 7, 5, 0), (5, 4, 6, 1), (6, 5, 7, 2), (7, 6, 4, 3),
)  # fmt: skip


def scaled_jacobian(nodes: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Smallest scaled Jacobian over the corners of each cell: 1 for a box or rectangle, 0 or less when folded.

    Parameters
    ----------
    nodes : array (n, 3)
        Places (m).
    cells : array (m, 8) or (m, 4)
        Hexahedra in VTK order, or quadrilaterals in one plane that, unless folded, all turn the same way round.

    Notes
    -----
    Knupp (2000), "Achieving finite element mesh quality via optimization of the Jacobian matrix norm".
    """
    smallest = np.full(len(cells), np.inf)
    if cells.shape[1] == 4:
        corners = nodes[cells]
        facing = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]).sum(axis=0)
        facing /= max(float(np.linalg.norm(facing)), 1e-300)
        for corner in range(4):
            a, b = (corners[:, (corner + step) % 4] - corners[:, corner] for step in (1, 3))
            length = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1)
            np.minimum(smallest, np.cross(a, b) @ facing / np.maximum(length, 1e-300), out=smallest)
        return smallest
    for corner, first, second, third in _CORNERS:
        start = nodes[cells[:, corner]]
        a, b, c = (nodes[cells[:, end]] - start for end in (first, second, third))
        length = np.linalg.norm(a, axis=1) * np.linalg.norm(b, axis=1) * np.linalg.norm(c, axis=1)
        volume = np.einsum("ij,ij->i", a, np.cross(b, c))
        np.minimum(smallest, volume / np.maximum(length, 1e-300), out=smallest)
    return smallest


def aspect_ratio(nodes: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Longest edge over shortest edge of each hexahedron or quadrilateral."""
    pairs = sorted({(min(a, b), max(a, b)) for a, *ends in _CORNERS for b in ends})
    if cells.shape[1] == 4:
        pairs = [(corner, (corner + 1) % 4) for corner in range(4)]
    lengths = np.stack([np.linalg.norm(nodes[cells[:, a]] - nodes[cells[:, b]], axis=1) for a, b in pairs])
    return np.asarray(lengths.max(axis=0) / np.maximum(lengths.min(axis=0), 1e-300))
