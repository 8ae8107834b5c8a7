"""Crossings of a step with faces: the ground, the edge of the domain, witness surfaces, and the bodies of obstacles.

A face is a point (3) and a normal (3). Witnesses and obstacles stand in tables alike: a number, a box (6) around all of
the row, and from the column `FACE` on its faces: one of a plane witness, `FACES` of an obstacle, which is convex: the
points behind all of them.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from flight.kernels.compiling import inner_kernel
from flight.kernels.roots import PRODUCT, sign_changes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

CYLINDER, RECTANGLE, POLYGON, GROUP = 0, 1, 2, 3
FACE, FACES = 7, 6
# an obstacle's row: its number, box, faces; a witness's: its kind, box, face (of a cylinder: centre, radius, bottom and
# top), axes in the plane (3, 3), half sizes (2), first vertex and the one after the last, number of the witness, and
# how many rows of a group follow this one, which holds nothing but the box around them
WITNESS_NUMBER, IN_GROUP = 23, 24
_FIRST_AXIS, _SECOND_AXIS, _HALF, _VERTICES = 13, 16, 19, 21
NOWHERE = 2.0  # beyond the step

PIECES_SHAPE = (64, 14)  # halves of a step: coefficients of x and y about the axis, lower and upper end
JOINTS_SHAPE = (2, 5 * FACES + 1)
FARTHEST_SQUARED = 32.0**2  # radii squared; a step that reaches farther is halved
NARROWEST_PIECE = 2.0**-50


class Scratch(NamedTuple):
    """A step, and arrays in which its crossings are worked out."""

    points: Array  # (6, 6) Bernstein coefficients of positions (degree 5) and velocities (degree 4)
    state: Array  # (6,) position and velocity at a place on it
    hull: Array  # (6,) box around the positions
    stack: Array
    roots: Array
    pieces: Array
    joints: Array  # positions on the step in order, and what each is
    terrain_pieces: Array


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
def enclose(points: Array, hull: Array) -> None:
    """Box (6,) around the control points of the positions, in which the path lies."""
    for axis in range(3):
        hull[2 * axis], hull[2 * axis + 1] = lowest_of(points[axis], 0), highest_of(points[axis], 0)


@inner_kernel()
def misses(hull: Array, row: Array) -> bool:
    """Whether the step's hull lies wholly off the box of a row."""
    for axis in range(0, 6, 2):  # noqa: SIM110 - a kernel has no generators
        if hull[axis + 1] < row[1 + axis] or hull[axis] > row[2 + axis]:
            return True
    return False


@inner_kernel()
def _distances(points: Array, face: Array, stack: Array) -> tuple[float, bool, bool]:
    """Distance of the step from a face's plane, as a polynomial in `stack`.

    Returns the size of the numbers whose difference it is, and whether coefficients are before and behind the face.
    """
    px, py, pz, nx, ny, nz = face[0], face[1], face[2], face[3], face[4], face[5]
    scale, before, behind = 0.0, False, False
    for i in range(6):
        x, y, z = points[0, i], points[1, i], points[2, i]
        value = nx * (x - px) + ny * (y - py) + nz * (z - pz)
        stack[0, i] = value
        scale = max(scale, abs(nx) * (abs(x) + abs(px)) + abs(ny) * (abs(y) + abs(py)) + abs(nz) * (abs(z) + abs(pz)))
        before, behind = before or value >= 0.0, behind or value < 0.0
    return scale, before, behind


@inner_kernel()
def cross_plane(points: Array, face: Array, stack: Array, roots: Array) -> int:
    """Find the crossings of a face's plane; positions on the step in `roots`."""
    scale, before, behind = _distances(points, face, stack)
    return sign_changes(stack, 5, scale, roots) if before and behind else 0


@inner_kernel()
def put_in_order(joints: Array, count: int, position: float, what: float) -> None:
    """Put a position on the step, and what it is, among the `count` that are there."""
    while count > 0 and joints[0, count - 1] > position:
        joints[0, count], joints[1, count] = joints[0, count - 1], joints[1, count - 1]
        count -= 1
    joints[0, count], joints[1, count] = position, what


@inner_kernel()
def enter_obstacles(obstacles: Array, until: float, step: Scratch) -> tuple[float, int, int]:
    """Find the first position on the step, before `until`, where it enters an obstacle (2.0: none), and the face."""
    theta, which, face = NOWHERE, -1, -1
    enclose(step.points, step.hull)
    for index in range(obstacles.shape[0]):
        if not misses(step.hull, obstacles[index]):
            position, on = _enter(obstacles[index], step.points, step.joints, step.stack, step.roots)
            if position <= until and position < theta:
                theta, which, face = position, index, on
    return theta, which, face


@inner_kernel()
def _enter(row: Array, points: Array, joints: Array, stack: Array, roots: Array) -> tuple[float, int]:
    """Position where the step enters one body, and the face.

    The step is behind a face or before it, and changes over at the sign changes of its distance; it is inside once it
    is behind all. No computed position is tested, so no path slips in between two faces or through a thin body.
    """
    count = outside = 0  # `outside`: one bit a face that the step is before
    nearest, nearest_face = -np.inf, 0
    for face in range(FACES):
        scale, before, behind = _distances(points, row[FACE + 6 * face : FACE + 6 * face + 6], stack)
        if not behind:
            return NOWHERE, -1
        if stack[0, 0] >= 0.0:
            outside |= 1 << face
        elif stack[0, 0] > nearest:
            nearest, nearest_face = stack[0, 0], face
        if before:
            for k in range(sign_changes(stack, 5, scale, roots)):
                put_in_order(joints, count, roots[k], face)
                count += 1
    if outside == 0:
        return 0.0, nearest_face
    for k in range(count):
        outside ^= 1 << int(joints[1, k])
        if outside == 0:
            return joints[0, k], int(joints[1, k])
    return NOWHERE, -1


@inner_kernel()
def cross_cylinder(
    points: Array, cx: float, cy: float, radius: float, pieces: Array, stack: Array, roots: Array
) -> int:
    """Find the crossings of the vertical cylinder about (cx, cy); positions on the step in `roots`.

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
        if highest_of(piece, 0) < -radius or lowest_of(piece, 0) > radius:
            continue
        if highest_of(piece, 6) < -radius or lowest_of(piece, 6) > radius:
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
    """Position and velocity (6,) of the dense output at theta in [0, 1]."""
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
        return row[FACE + 4] <= z <= row[FACE + 5]
    dx, dy, dz = x - row[FACE], y - row[FACE + 1], z - row[FACE + 2]
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
