"""Which hexahedra share a face."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["face_neighbours"]

_FACES = np.array([[0, 3, 7, 4], [1, 2, 6, 5], [0, 1, 5, 4], [3, 2, 6, 7], [0, 1, 2, 3], [4, 5, 6, 7]])


def face_neighbours(cells: NDArray[np.int64], group: NDArray[np.int64]) -> NDArray[np.int64]:
    """Face neighbours of every hexahedron within its own group.

    Parameters
    ----------
    cells : (m, 8) int64
        Nodes in VTK's order.
    group : (m,) int64
        Cells of different groups are not neighbours.

    Returns
    -------
    (m, 6) int64
        The cell on the other side of each face, -1 where there is none. A face of more than two cells joins them
        in pairs.
    """
    faces = np.sort(cells[:, _FACES].reshape(-1, 4), axis=1)
    size = int(cells.max()) + 1
    order = np.lexsort((faces[:, 2] * size + faces[:, 3], faces[:, 0] * size + faces[:, 1]))
    ranked = faces[order]
    owner = order // 6
    match = (ranked[1:] == ranked[:-1]).all(axis=1) & (group[owner[1:]] == group[owner[:-1]])
    neighbours = np.full(len(cells) * 6, -1, dtype=np.int64)
    neighbours[order[:-1][match]] = owner[1:][match]
    neighbours[order[1:][match]] = owner[:-1][match]
    return neighbours.reshape(-1, 6)
