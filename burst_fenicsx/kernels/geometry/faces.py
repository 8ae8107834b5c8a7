"""Faces of hexahedra: their nodes, their area vectors, and the cells behind them."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel

__all__ = ["FACES", "TENSOR_ORDER", "area_vectors", "face_neighbours"]

FACES = np.array([[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]])
"""Nodes of a hexahedron's faces in VTK order, normals outward."""

TENSOR_ORDER = [0, 1, 3, 2, 4, 5, 7, 6]
"""A hexahedron's nodes in VTK order, taken in tensor-product order, or the reverse."""


def area_vectors(corner: np.ndarray) -> np.ndarray:
    """Area vectors (faces, 3) in m2 of quadrilaterals with corners (faces, 4, 3) in m, outward where their order is."""
    vectors: np.ndarray = 0.5 * np.cross(corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1])
    return vectors


@kernel
def face_neighbours(cells: np.ndarray, place: np.ndarray) -> np.ndarray:
    """Find the cell behind every face of every cell (cells, 6), int32; -1 where there is none.

    Faces are sorted by their lowest place, and compared with those few that share it. `cells` (cells, 8) in VTK order;
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
