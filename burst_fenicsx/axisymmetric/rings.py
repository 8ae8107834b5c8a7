"""Integrals over rings of quadrilaterals: volumes, nodal masses; folded cells."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["areas", "folded", "longest_edges", "nodal_volumes", "ring_volumes"]

_CORNERS = np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
_GAUSS = 1.0 / np.sqrt(3.0)


def nodal_volumes(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.float64]:
    """Integral of N_a over 2 pi r dA in every cell (m, 4), m3, exact by 2 x 2 Gauss points.

    At the axis it is 1/6 and 1/3 of a cell's volume. With a quarter a plane axial wave would not pass the axis
    undisturbed. `nodes` (n, 3) are (r, 0, z).
    """
    r, z = nodes[cells, 0], nodes[cells, 2]
    found = np.zeros(r.shape)
    for xi in (-_GAUSS, _GAUSS):
        for eta in (-_GAUSS, _GAUSS):
            shape = 0.25 * (1.0 + _CORNERS[:, 0] * xi) * (1.0 + _CORNERS[:, 1] * eta)
            by_xi = 0.25 * _CORNERS[:, 0] * (1.0 + _CORNERS[:, 1] * eta)
            by_eta = 0.25 * _CORNERS[:, 1] * (1.0 + _CORNERS[:, 0] * xi)
            jacobian = (r @ by_xi) * (z @ by_eta) - (r @ by_eta) * (z @ by_xi)
            found += (2.0 * np.pi * (r @ shape) * jacobian)[:, None] * shape
    return found


def ring_volumes(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.float64]:
    """Volumes of the rings (m,) in m3."""
    volumes: NDArray[np.float64] = nodal_volumes(nodes, cells).sum(axis=1)
    return volumes


def areas(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.float64]:
    """Areas of the quadrilaterals (m,) in m2."""
    corner = nodes[cells]
    one, other = corner[:, 2] - corner[:, 0], corner[:, 3] - corner[:, 1]
    area: NDArray[np.float64] = 0.5 * (one[:, 0] * other[:, 2] - one[:, 2] * other[:, 0])
    return area


def longest_edges(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.float64]:
    """Longest edge of every quadrilateral (m,) in m."""
    corner = nodes[cells]
    longest: NDArray[np.float64] = np.linalg.norm(np.roll(corner, -1, axis=1) - corner, axis=2).max(axis=1)
    return longest


def folded(nodes: NDArray[np.float64], cells: NDArray[np.integer]) -> NDArray[np.bool_]:
    """Whether a corner of a quadrilateral is turned inside out (m,)."""
    corner = nodes[cells]
    onward, back = np.roll(corner, -1, axis=1) - corner, np.roll(corner, 1, axis=1) - corner
    inside_out: NDArray[np.bool_] = (onward[..., 0] * back[..., 2] - onward[..., 2] * back[..., 0] <= 0.0).any(axis=1)
    return inside_out
