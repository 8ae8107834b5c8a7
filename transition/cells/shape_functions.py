"""Trilinear hexahedra: values at nodes, at points, and as modes.

A trilinear function of the reference coordinates xi, eta, zeta in [-1, 1] is a sum over the modes 1, xi, eta, zeta,
xi eta, xi zeta, eta zeta, xi eta zeta. The sign of each under a reflection of the coordinates is known, which is what
`transition.cells.cell_points` needs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


CORNERS = np.array(
    [[-1, -1, -1], [1, -1, -1], [1, 1, -1], [-1, 1, -1], [-1, -1, 1], [1, -1, 1], [1, 1, 1], [-1, 1, 1]], dtype=float
)
"""Reference coordinates of the nodes in VTK's order."""

_X, _Y, _Z = CORNERS.T
_MODES_AT_CORNERS = np.stack([np.ones(8), _X, _Y, _Z, _X * _Y, _X * _Z, _Y * _Z, _X * _Y * _Z])


def modes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (m, 8, k) of the modes from the values (m, 8, k) at the nodes in VTK's order."""
    return np.asarray(np.einsum("ai,mik->mak", _MODES_AT_CORNERS / 8.0, corners, optimize=True))


def trilinear(corners: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Trilinear interpolation in hexahedra (Eq. 31 with the hexahedron's shape functions).

    `corners` (k, 8, 3): values at the nodes in VTK's order; `point` (k, 3): coordinates 0 to 1 in the reference cell.
    """
    x, y, z = (np.stack([1.0 - point[:, i], point[:, i]]) for i in range(3))
    along_x, along_y = (0, 1, 1, 0) * 2, (0, 0, 1, 1) * 2
    weights = np.stack([x[along_x[i]] * y[along_y[i]] * z[i // 4] for i in range(8)], axis=1)
    return np.asarray(np.einsum("ki,kij->kj", weights, corners))
