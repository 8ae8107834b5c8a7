"""Hexahedra of a mesh: scaled Jacobians, lengths of edges, folded corners, and the cells behind their faces.

For one thread: a mesh is checked once, and a parallel loop takes a second longer to compile than it saves.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.geometry.faces import FACES
from burst_fenicsx.kernels.lanes import kernel

__all__ = [
    "CORNER_NEIGHBOURS",
    "EDGES",
    "edge_extremes",
    "face_neighbours",
    "folded_cells",
    "min_corner_volume",
    "min_scaled_jacobians",
]

CORNER_NEIGHBOURS = np.array([[1, 2, 4], [3, 0, 5], [0, 3, 6], [2, 1, 7], [6, 5, 0], [4, 7, 1], [7, 4, 2], [5, 6, 3]])
"""A corner's three neighbours along the cell's own directions, in right-handed order."""
EDGES = np.array([[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]])
_RUN = 256  # cells that share scratch


@kernel
def min_scaled_jacobians(nodes: np.ndarray, cells: np.ndarray) -> np.ndarray:
    """Each cell's smallest scaled Jacobian over its corners and its centre (cells,).

    The determinant of the three edge vectors over the product of their lengths; at the centre of the three
    directions' mean edges (Knupp 2003; the Verdict library's definition). `nodes` (nodes, 3) m, `cells` (cells, 8).
    """
    count = cells.shape[0]
    smallest = np.empty(count)
    for run in range(count // _RUN + 1):
        x, vectors = np.empty((8, 3)), np.empty((3, 3))
        for cell in range(run * _RUN, min((run + 1) * _RUN, count)):
            for n in range(8):
                for i in range(3):
                    x[n, i] = nodes[cells[cell, n], i]
            minimum = np.inf
            for corner in range(8):
                for k in range(3):
                    for i in range(3):
                        vectors[k, i] = x[CORNER_NEIGHBOURS[corner, k], i] - x[corner, i]
                minimum = min(minimum, _scaled_determinant(vectors))
            for i in range(3):
                vectors[0, i] = x[1, i] + x[3, i] + x[5, i] + x[7, i] - (x[0, i] + x[2, i] + x[4, i] + x[6, i])
                vectors[1, i] = x[3, i] + x[2, i] + x[7, i] + x[6, i] - (x[0, i] + x[1, i] + x[4, i] + x[5, i])
                vectors[2, i] = x[4, i] + x[5, i] + x[7, i] + x[6, i] - (x[0, i] + x[1, i] + x[3, i] + x[2, i])
            smallest[cell] = min(minimum, _scaled_determinant(vectors))
    return smallest


@kernel
def _scaled_determinant(v: np.ndarray) -> float:
    """Determinant of three vectors, the rows of `v`, over the product of their lengths."""
    squares = 1.0
    for k in range(3):
        squares *= v[k, 0] * v[k, 0] + v[k, 1] * v[k, 1] + v[k, 2] * v[k, 2]
    return _triple(v[0], v[1], v[2]) / max(np.sqrt(squares), 1e-300)


@kernel
def _triple(a: np.ndarray, b: np.ndarray, c: np.ndarray) -> float:
    """Triple product a . (b x c)."""
    return a[0] * (b[1] * c[2] - b[2] * c[1]) + a[2] * (b[0] * c[1] - b[1] * c[0]) + a[1] * (b[2] * c[0] - b[0] * c[2])


@kernel
def edge_extremes(nodes: np.ndarray, cells: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Each cell's shortest and longest edge (cells,) in m; `nodes` (nodes, 3) m, `cells` (cells, 8)."""
    shortest, longest = np.empty(cells.shape[0]), np.empty(cells.shape[0])
    for cell in range(cells.shape[0]):
        low, high = np.inf, 0.0
        for edge in range(12):
            a, b = cells[cell, EDGES[edge, 0]], cells[cell, EDGES[edge, 1]]
            x, y, z = nodes[b, 0] - nodes[a, 0], nodes[b, 1] - nodes[a, 1], nodes[b, 2] - nodes[a, 2]
            square = x * x + y * y + z * z
            low, high = min(low, square), max(high, square)
        shortest[cell], longest[cell] = np.sqrt(low), np.sqrt(high)
    return shortest, longest


@kernel
def min_corner_volume(position: np.ndarray, nodes: np.ndarray) -> float:
    """Minimum triple product (m3) of the edges at a corner of a cell; `nodes` (8,)."""
    minimum = np.inf
    for corner in range(8):
        here = position[nodes[corner]]
        x = position[nodes[CORNER_NEIGHBOURS[corner, 0]]]
        y = position[nodes[CORNER_NEIGHBOURS[corner, 1]]]
        z = position[nodes[CORNER_NEIGHBOURS[corner, 2]]]
        ax, ay, az = z[0] - here[0], z[1] - here[1], z[2] - here[2]
        bx, by, bz = x[0] - here[0], x[1] - here[1], x[2] - here[2]
        cx, cy, cz = y[0] - here[0], y[1] - here[1], y[2] - here[2]
        volume = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        minimum = min(minimum, volume)
    return minimum


@kernel
def folded_cells(position: np.ndarray, dofmap: np.ndarray) -> np.ndarray:
    """Whether a corner of each cell is turned inside out (cells,).

    `position` (nodes, 3) m, `dofmap` (cells, 8).
    """
    folded = np.zeros(dofmap.shape[0], dtype=np.bool_)
    for cell in range(dofmap.shape[0]):
        folded[cell] = min_corner_volume(position, dofmap[cell]) <= 0.0
    return folded


@kernel
def face_neighbours(cells: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Find the cell behind every face of every cell (cells, 6), int32; -1 where there is none.

    Faces are sorted by their lowest place, and compared with those few that share it. `cells` (cells, 8);
    `place` (nodes,) gives coincident nodes one number, below their count.
    """
    sorted_places = np.empty((6 * cells.shape[0], 4), dtype=np.int32)
    offset = np.zeros(place.size + 1, dtype=np.int32)
    for cell in range(cells.shape[0]):
        for side in range(6):
            face = 6 * cell + side
            for k in range(4):
                value = np.int32(place[cells[cell, FACES[side, k]]])
                at = k
                while at > 0 and sorted_places[face, at - 1] > value:
                    sorted_places[face, at] = sorted_places[face, at - 1]
                    at -= 1
                sorted_places[face, at] = value
            offset[sorted_places[face, 0] + 1] += 1
    for lowest in range(place.size):
        offset[lowest + 1] += offset[lowest]
    entered = np.zeros(place.size, dtype=np.int32)
    entries = np.empty(6 * cells.shape[0], dtype=np.int32)
    neighbours = np.full((cells.shape[0], 6), -1, dtype=np.int32)
    for face in range(6 * cells.shape[0]):
        lowest = sorted_places[face, 0]
        for entry in range(offset[lowest], offset[lowest] + entered[lowest]):
            other = entries[entry]
            if (
                sorted_places[other, 1] == sorted_places[face, 1]
                and sorted_places[other, 2] == sorted_places[face, 2]
                and sorted_places[other, 3] == sorted_places[face, 3]
            ):
                neighbours[face // 6, face % 6] = other // 6
                neighbours[other // 6, other % 6] = face // 6
        entries[offset[lowest] + entered[lowest]] = face
        entered[lowest] += 1
    return neighbours
