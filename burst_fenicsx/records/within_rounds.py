"""What lies within a round: points in its hexahedra, and points nearer to its axis than its casing."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.geometry.faces import FACES, area_vectors
from burst_fenicsx.meshing.placement import frame
from fragfield_base.elementary import arctan2

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.meshing import HexahedralMesh
    from burst_fenicsx.problem import Round

_MOST_OVERLAP = 0.125  # of a thin cell's width
_OPPOSITE = (1, 0, 4, 5, 2, 3)  # of each of `FACES`
_FEWEST_SECTORS, _MOST_SECTORS = 12, 36
_CELLS_ALONG = 2.0  # of a bin along the axis


class CasingRadii:
    """How far each round's casing reaches from its axis, by station and azimuth.

    Parameters
    ----------
    mesh : the whole mesh. rounds : in order. cell_size : m.
    """

    def __init__(self, mesh: HexahedralMesh, rounds: Sequence[Round], cell_size: float) -> None:
        self._axes = [(np.asarray(item.position, dtype=float), frame(item.axis)) for item in rounds]
        self._ends, radius = [], 0.0
        for index in range(len(rounds)):
            x, y, z = self._local(mesh.nodes[np.unique(mesh.cells[mesh.round == index])], index)
            self._ends.append((float(z.min()), float(z.max())))
            radius = max(radius, float(np.hypot(x, y).max()))
        length = max(high - low for low, high in self._ends)
        self._sectors = int(np.clip(2.0 * np.pi * radius / cell_size, _FEWEST_SECTORS, _MOST_SECTORS))
        self._bins = int(2.0 * length / (_CELLS_ALONG * cell_size)) + 1  # as much beyond both ends as between them

    def largest(self, position: np.ndarray, rounds: np.ndarray) -> np.ndarray:
        """Largest distance from the axis (rounds, bins, sectors) m of casing nodes (n, 3) of `rounds` (n,)."""
        radii = np.zeros((len(self._axes), self._bins, self._sectors))
        for index, of_round in enumerate(radii):
            station, sector, radius = self._binned(position[rounds == index], index)
            np.maximum.at(of_round, (station, sector), radius)
        return radii

    def enclose(self, points: np.ndarray, radii: np.ndarray) -> np.ndarray:
        """Whether each point (n, 3) lies nearer to a round's axis than its casing in its or a next sector (n, rounds).

        `radii` as `largest` gives them.
        """
        widest = np.maximum(radii, np.maximum(np.roll(radii, 1, axis=2), np.roll(radii, -1, axis=2)))
        enclosed = np.zeros((len(points), len(self._axes)), dtype=bool)
        for index, of_round in enumerate(widest):
            station, sector, radius = self._binned(points, index)
            enclosed[:, index] = radius < of_round[station, sector]
        return enclosed

    def _binned(self, points: np.ndarray, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Station bin, sector and distance from the axis (m) of points (n, 3) in the frame of a round."""
        x, y, z = self._local(points, index)
        low, high = self._ends[index]
        along = (z - low) / (high - low)
        station = np.clip((0.5 * along + 0.25) * self._bins, 0, self._bins - 1).astype(np.int64)
        sector = ((arctan2(y, x) / (2.0 * np.pi) + 0.5) * self._sectors).astype(np.int64) % self._sectors
        return station, sector, np.hypot(x, y)

    def _local(self, points: np.ndarray, index: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Coordinates (m) in the frame of a round; point by point, so that they do not depend on the number of them."""
        centre, axes = self._axes[index]
        x, y, z = (((points - centre) * axis).sum(axis=1) for axis in axes)
        return x, y, z


def hold(corner: np.ndarray, points: np.ndarray, outward: np.ndarray, overlap: float) -> np.ndarray:
    """Whether hexahedra hold points: each on the inner side of the mean planes of all faces (n,).

    Parameters
    ----------
    corner : (n, 8, 3) m. points : (n, 3) m.
    outward : (n, 6) bool, faces that look out of the body: of these a point must lie deeper than `overlap` (m), or than
        an eighth of a thin cell's width.
    """
    centre = np.stack([corner[:, face].mean(axis=1) for face in FACES], axis=1)
    held = np.ones(len(points), dtype=bool)
    for side, face in enumerate(FACES):
        normal = area_vectors(corner[:, face])
        normal /= np.maximum(np.sqrt((normal**2).sum(axis=1)), 1e-300)[:, None]
        width = np.sqrt(((centre[:, side] - centre[:, _OPPOSITE[side]]) ** 2).sum(axis=1))
        needed = np.where(outward[:, side], np.minimum(overlap, _MOST_OVERLAP * width), 0.0)
        held &= ((centre[:, side] - points) * normal).sum(axis=1) >= needed
    return held
