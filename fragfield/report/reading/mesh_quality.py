"""Quality of the cells, measured on the nodes that the snapshot carries: hexahedra, or quadrilaterals of a meridian."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["aspect_ratio", "scaled_jacobian"]


def scaled_jacobian(nodes: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Smallest scaled Jacobian of each cell: 1 for a box or rectangle, 0 or less when folded.

    Of hexahedra over corners and centre, of quadrilaterals over corners, as the burst measures its meshes.

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
    if cells.shape[1] == 4:
        from burst_fenicsx.meshing.quality import quadrilateral_jacobians

        return quadrilateral_jacobians(_in_plane(nodes[cells]))
    from burst_fenicsx.kernels.geometry.faces import reordered
    from burst_fenicsx.kernels.geometry.shapes import min_scaled_jacobians

    return np.asarray(min_scaled_jacobians(_plain(nodes, float), _plain(reordered(cells), np.int64)))


def aspect_ratio(nodes: NDArray[np.float64], cells: NDArray[np.int64]) -> NDArray[np.float64]:
    """Longest edge over shortest edge of each hexahedron or quadrilateral."""
    if cells.shape[1] == 4:
        from burst_fenicsx.meshing.quality import quadrilateral_edges

        lengths = quadrilateral_edges(nodes[cells])
        shortest, longest = lengths.min(axis=1), lengths.max(axis=1)
    else:
        from burst_fenicsx.kernels.geometry.faces import reordered
        from burst_fenicsx.kernels.geometry.shapes import edge_extremes

        shortest, longest = edge_extremes(_plain(nodes, float), _plain(reordered(cells), np.int64))
    return np.asarray(longest / np.maximum(shortest, 1e-300))


def _plain(values: NDArray[np.generic], kind: type) -> NDArray[np.generic]:
    """An array as the kernels were compiled for."""
    return np.ascontiguousarray(values, dtype=kind)


def _in_plane(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """Corners (m, 4, 3) of quadrilaterals in one plane as coordinates (m, 4, 2) in it, counter-clockwise."""
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1]).sum(axis=0)
    normal /= max(float(np.linalg.norm(normal)), 1e-300)
    first = np.cross(normal, np.eye(3)[int(np.argmin(np.abs(normal)))])
    first /= max(float(np.linalg.norm(first)), 1e-300)
    return np.asarray(corners @ np.column_stack([first, np.cross(normal, first)]))
