"""Crossings of a step with the ground, the edge of the domain and the witness surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.roots import PRODUCT, sign_changes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = [
    "CYLINDER",
    "GROUP",
    "IN_GROUP",
    "PIECES_SHAPE",
    "POLYGON",
    "RECTANGLE",
    "WITNESS_COLUMNS",
    "WITNESS_NUMBER",
    "cross_cylinder",
    "cross_plane",
    "dense_state",
    "inside_outline",
    "lowest_of",
    "misses_box",
    "highest_of",
]

CYLINDER, RECTANGLE, POLYGON, GROUP = 0, 1, 2, 3
# a witness row: kind; box (6); centre or point (3); normal (3), or radius first; axes in the plane (3, 3); half sizes
# (2); first vertex and the one after the last; number of the witness; rows of a group after this one, which holds
# nothing but the box around them
WITNESS_COLUMNS = 25
WITNESS_NUMBER, IN_GROUP = 23, 24
_BOX, _POINT, _NORMAL, _FIRST_AXIS, _SECOND_AXIS, _HALF, _VERTICES = 1, 7, 10, 13, 16, 19, 21

PIECES_SHAPE = (64, 14)  # halves of a step: coefficients of x and y about the axis, lower and upper end
FARTHEST_SQUARED = 32.0**2  # radii squared; a step that reaches farther is halved
NARROWEST_PIECE = 2.0**-50


@inner_kernel()
def lowest_of(row: Array, first: int) -> float:
    """Smallest of the six coefficients from the column `first`: no point of the curve lies below it."""
    a, b, c, d, e, f = row[first], row[first + 1], row[first + 2], row[first + 3], row[first + 4], row[first + 5]
    return min(a, b, c, d, e, f)


@inner_kernel()
def highest_of(row: Array, first: int) -> float:
    """Greatest of the six coefficients from the column `first`: no point of the curve lies above it."""
    a, b, c, d, e, f = row[first], row[first + 1], row[first + 2], row[first + 3], row[first + 4], row[first + 5]
    return max(a, b, c, d, e, f)


@inner_kernel()
def misses_box(points: Array, row: Array) -> bool:
    """Return whether the hull of the step's control points lies wholly off the witness's box."""
    for axis in range(3):
        p = points[axis]
        if max(p[0], p[1], p[2], p[3], p[4], p[5]) < row[_BOX + 2 * axis]:
            return True
        if min(p[0], p[1], p[2], p[3], p[4], p[5]) > row[_BOX + 2 * axis + 1]:
            return True
    return False


@inner_kernel()
def cross_plane(
    points: Array, px: float, py: float, pz: float, nx: float, ny: float, nz: float, stack: Array, roots: Array
) -> int:
    """Find the crossings of the plane through (px, py, pz) with normal (nx, ny, nz); places on the step in `roots`."""
    coefficients = stack[0]
    scale = 0.0
    above = below = False
    for i in range(6):
        x, y, z = points[0, i], points[1, i], points[2, i]
        value = nx * (x - px) + ny * (y - py) + nz * (z - pz)
        coefficients[i] = value
        scale = max(scale, abs(nx) * (abs(x) + abs(px)) + abs(ny) * (abs(y) + abs(py)) + abs(nz) * (abs(z) + abs(pz)))
        if value >= 0.0:
            above = True
        else:
            below = True
    if not (above and below):
        return 0
    return sign_changes(stack, 5, scale, roots)


@inner_kernel()
def cross_cylinder(
    points: Array, cx: float, cy: float, radius: float, pieces: Array, stack: Array, roots: Array
) -> int:
    """Find the crossings of the vertical cylinder about (cx, cy); places on the step in `roots`.

    Entering and leaving within one step, or touching, is found as on any other step: the squared distance from the
    axis is a polynomial of degree 10 whose sign changes are isolated. On a step far longer than the cylinder is wide
    that polynomial would drown in rounding, so such a step is halved first, and halves off the cylinder are dropped.
    """
    for i in range(6):
        pieces[0, i], pieces[0, 6 + i] = points[0, i] - cx, points[1, i] - cy
    pieces[0, 12], pieces[0, 13] = 0.0, 1.0
    squared = radius * radius
    depth, count = 1, 0
    while depth > 0 and count < roots.size:
        depth -= 1
        piece = pieces[depth]
        farthest = 0.0
        for i in range(6):
            farthest = max(farthest, piece[i] * piece[i] + piece[6 + i] * piece[6 + i])
        if farthest < squared:
            continue  # the hull lies inside the disc
        if _one_sided(piece[:6], radius) or _one_sided(piece[6:12], radius):
            continue
        low, high = piece[12], piece[13]
        if farthest > FARTHEST_SQUARED * squared and high - low > NARROWEST_PIECE:
            _halve(piece, pieces[depth + 1])
            depth += 2
            continue
        coefficients = stack[0]
        for k in range(11):
            coefficients[k] = 0.0
        for i in range(6):
            for j in range(6):
                coefficients[i + j] += PRODUCT[i, j] * (piece[i] * piece[j] + piece[6 + i] * piece[6 + j])
        for k in range(11):
            coefficients[k] -= squared
        found = sign_changes(stack, 10, farthest, roots[count:])
        for k in range(count, count + found):
            roots[k] = low + (high - low) * roots[k]
        count += found
    return count


@inner_kernel()
def _one_sided(p: Array, radius: float) -> bool:
    """Return whether one coordinate's hull lies wholly beyond the radius on one side."""
    return max(p[0], p[1], p[2], p[3], p[4], p[5]) < -radius or min(p[0], p[1], p[2], p[3], p[4], p[5]) > radius


@inner_kernel()
def _halve(piece: Array, left: Array) -> None:
    """Cut a curve in two (de Casteljau): the left half into `left`, the right half stays; the joint is the same."""
    for j in range(0, 12, 6):
        left[j] = piece[j]
        for level in range(1, 6):
            for i in range(6 - level):
                piece[j + i] = 0.5 * (piece[j + i] + piece[j + i + 1])
            left[j + level] = piece[j]
    middle = 0.5 * (piece[12] + piece[13])
    left[12], left[13] = piece[12], middle
    piece[12] = middle


@inner_kernel()
def dense_state(points: Array, theta: float, out: Array) -> None:
    """Place and velocity (6,) of the dense output at theta in [0, 1]."""
    s, t = 1.0 - theta, theta
    w0, w1, w2, w3, w4 = s * s * s * s, 4.0 * s * s * s * t, 6.0 * s * s * t * t, 4.0 * s * t * t * t, t * t * t * t
    v1, v2, v3, v4 = 5.0 * w0 * t, 10.0 * s * s * s * t * t, 10.0 * s * s * t * t * t, 5.0 * w4 * s
    for i in range(3):
        p = points[i]
        out[i] = w0 * s * p[0] + v1 * p[1] + v2 * p[2] + v3 * p[3] + v4 * p[4] + w4 * t * p[5]
        p = points[3 + i]
        out[3 + i] = w0 * p[0] + w1 * p[1] + w2 * p[2] + w3 * p[3] + w4 * p[4]


@inner_kernel()
def inside_outline(row: Array, vertices: Array, x: float, y: float, z: float) -> bool:
    """Whether a position on a witness's plane or cylinder lies within its outline or height (edges belong to it)."""
    kind = int(row[0])
    if kind == CYLINDER:
        return row[_NORMAL + 1] <= z <= row[_NORMAL + 2]
    dx, dy, dz = x - row[_POINT], y - row[_POINT + 1], z - row[_POINT + 2]
    a = dx * row[_FIRST_AXIS] + dy * row[_FIRST_AXIS + 1] + dz * row[_FIRST_AXIS + 2]
    b = dx * row[_SECOND_AXIS] + dy * row[_SECOND_AXIS + 1] + dz * row[_SECOND_AXIS + 2]
    if kind == RECTANGLE:
        return abs(a) <= row[_HALF] and abs(b) <= row[_HALF + 1]
    first, last = int(row[_VERTICES]), int(row[_VERTICES + 1])
    inside = False
    j = last - 1
    for i in range(first, last):  # even-odd rule (Shimrat 1962)
        bi, bj = vertices[i, 1], vertices[j, 1]
        if (bi > b) != (bj > b) and a < vertices[i, 0] + (b - bi) * (vertices[j, 0] - vertices[i, 0]) / (bj - bi):
            inside = not inside
        j = i
    return inside
