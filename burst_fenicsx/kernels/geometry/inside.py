"""Points within trilinear hexahedra, by inverse mapping."""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.lanes import kernel, parallel_kernel

__all__ = ["points_inside"]

_ITERATIONS = 20
_CONVERGED = 1e-9  # of the natural coordinates
_FARTHEST = 2.0  # natural coordinate beyond which Newton's method is held back
_THICKEST_SKIN = 0.25  # of half of a cell's width
_RUN = 64  # points that share scratch


@parallel_kernel
def points_inside(
    points: np.ndarray,
    first: np.ndarray,
    candidate: np.ndarray,
    position: np.ndarray,
    cells: np.ndarray,
    skin: float,
    outward: np.ndarray,
    found: np.ndarray,
) -> None:
    """Find for each point a cell that holds it, not nearer than `skin` (m) to a side that looks outward.

    Parameters
    ----------
    points : (points, 3) m.
    first, candidate : the cells that each point may lie in: (points + 1,) offsets into (n,) rows of `cells`.
    position : (nodes, 3) m. cells : (cells, 8) their nodes in tensor-product order.
    skin : depth (m) below which a point does not count as inside; of a thin cell no more than a share of its width.
    outward : (cells, 6) bool, sides -x, +x, -y, +y, -z, +z in natural coordinates that look out of the body.
    found : (points,) int32, out: the first candidate that holds the point, -1 where none does.
    """
    parts = points.shape[0] // _RUN + 1
    for part in numba.prange(parts):
        corner, natural, limit = np.empty((8, 3)), np.empty(3), np.empty(6)
        for k in range(part * points.shape[0] // parts, (part + 1) * points.shape[0] // parts):
            found[k] = -1
            for c in range(first[k], first[k + 1]):
                cell = candidate[c]
                for n in range(8):
                    for i in range(3):
                        corner[n, i] = position[cells[cell, n], i]
                if not _natural_coordinates(points[k], corner, natural):
                    continue
                _limits(corner, skin, outward[cell], limit)
                inside = True
                for i in range(3):
                    inside &= -limit[2 * i] <= natural[i] <= limit[2 * i + 1]
                if inside:
                    found[k] = cell
                    break


@kernel
def _limits(corner: np.ndarray, skin: float, outward: np.ndarray, limit: np.ndarray) -> None:
    """Largest natural coordinates towards the six sides at which a point still counts as inside."""
    for axis in range(3):
        bit = 1 << axis
        square = 0.0
        for i in range(3):
            across = 0.0
            for n in range(8):
                across += 0.25 * corner[n, i] if n & bit else -0.25 * corner[n, i]
            square += across * across
        cut = min(2.0 * skin / max(np.sqrt(square), 1e-300), _THICKEST_SKIN)
        for end in range(2):
            limit[2 * axis + end] = 1.0 - cut if outward[2 * axis + end] else 1.0 + _CONVERGED


@kernel
def _natural_coordinates(point: np.ndarray, corner: np.ndarray, natural: np.ndarray) -> bool:
    """Natural coordinates (3,) of a point (m) in a cell with corners (8, 3) in tensor-product order.

    By Newton's method. False where it does not converge or the mapping is singular on the way.
    """
    natural[:] = 0.0
    jacobian, residual = np.empty((3, 3)), np.empty(3)
    for _ in range(_ITERATIONS):
        jacobian[:] = 0.0
        for i in range(3):
            residual[i] = point[i]
        for n in range(8):
            x = 1.0 + natural[0] if n & 1 else 1.0 - natural[0]
            y = 1.0 + natural[1] if n & 2 else 1.0 - natural[1]
            z = 1.0 + natural[2] if n & 4 else 1.0 - natural[2]
            dx = 1.0 if n & 1 else -1.0
            dy = 1.0 if n & 2 else -1.0
            dz = 1.0 if n & 4 else -1.0
            for i in range(3):
                residual[i] -= 0.125 * x * y * z * corner[n, i]
                jacobian[i, 0] += 0.125 * dx * y * z * corner[n, i]
                jacobian[i, 1] += 0.125 * x * dy * z * corner[n, i]
                jacobian[i, 2] += 0.125 * x * y * dz * corner[n, i]
        largest = _solve(jacobian, residual)
        if not largest < np.inf:
            return False
        for i in range(3):
            natural[i] = min(max(natural[i] + residual[i], -_FARTHEST), _FARTHEST)
        if largest < _CONVERGED:
            return True
    return False


@kernel
def _solve(matrix: np.ndarray, vector: np.ndarray) -> float:
    """Solve a 3x3 system in place by Cramer's rule; the largest component, infinite where the matrix is singular."""
    a, b, c = matrix[0, 0], matrix[0, 1], matrix[0, 2]
    d, e, f = matrix[1, 0], matrix[1, 1], matrix[1, 2]
    g, h, k = matrix[2, 0], matrix[2, 1], matrix[2, 2]
    determinant = a * (e * k - f * h) - b * (d * k - f * g) + c * (d * h - e * g)
    if determinant == 0.0:
        return np.inf
    u, v, w = vector[0], vector[1], vector[2]
    vector[0] = (u * (e * k - f * h) - b * (v * k - f * w) + c * (v * h - e * w)) / determinant
    vector[1] = (a * (v * k - f * w) - u * (d * k - f * g) + c * (d * w - v * g)) / determinant
    vector[2] = (a * (e * w - v * h) - b * (d * w - v * g) + u * (d * h - e * g)) / determinant
    return max(abs(vector[0]), abs(vector[1]), abs(vector[2]))
