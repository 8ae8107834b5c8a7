"""Interpolation in cells from the values at their nodes (Eq. 31): hexahedra, and quadrilaterals of a meridian.

The shape functions are those of dolfinx's Lagrange elements of degree 1, tabulated by basix. A function of this space
is also a sum over modes, the products of the reference coordinates from -1 to 1 (1, xi, eta, zeta, xi eta, ...). The
sign of each under a reflection of the coordinates is known, which is what `transition.cells.points` needs.
"""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


VTK_ORDER = {8: (0, 1, 3, 2, 4, 5, 7, 6), 4: (0, 1, 3, 2)}
"""Nodes of dolfinx's hexahedra and quadrilaterals in VTK's order, by their number."""
_FACTORS = {8: ((), (0,), (1,), (2,), (0, 1), (0, 2), (1, 2), (0, 1, 2)), 4: ((), (0,), (1,), (0, 1))}


@cache
def _element(nodes: int):  # type: ignore[no-untyped-def]  # noqa: ANN202 - basix has no types in all versions
    import basix

    cell = basix.CellType.hexahedron if nodes == 8 else basix.CellType.quadrilateral
    return basix.create_element(basix.ElementFamily.P, cell, 1)


@cache
def corner_coordinates(nodes: int) -> NDArray[np.float64]:
    """Reference coordinates (nodes, dimensions), -1 or 1, of the nodes of a cell in VTK's order."""
    return 2.0 * np.asarray(_element(nodes).points)[list(VTK_ORDER[nodes])] - 1.0


def interpolated(corners: NDArray[np.float64], point: NDArray[np.float64]) -> NDArray[np.float64]:
    """Values (k, j) in cells from the values (k, 8 or 4, j) at their nodes in VTK's order.

    `point` (k, 3 or 2): coordinates 0 to 1 in the reference cell.
    """
    nodes = corners.shape[1]
    weights = _element(nodes).tabulate(0, np.ascontiguousarray(point))[0, :, :, 0][:, list(VTK_ORDER[nodes])]
    return np.asarray((weights[:, None] @ corners)[:, 0])


def modes(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (m, 8 or 4, j) of the modes from the values (m, 8 or 4, j) at the nodes in VTK's order."""
    return np.asarray(_modes_at_nodes(corners.shape[1]) @ corners)


@cache
def _modes_at_nodes(nodes: int) -> NDArray[np.float64]:
    at = corner_coordinates(nodes)
    return np.stack([at[:, list(factors)].prod(axis=1) for factors in _FACTORS[nodes]]) / nodes
