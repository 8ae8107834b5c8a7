"""Where a step crosses the ground, the edge of the domain and the witness surfaces."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from flight.kernels.motion import take_step
from flight.kernels.roots import sign_changes

__all__ = [
    "CYLINDER",
    "POLYGON",
    "RECTANGLE",
    "WITNESS_COLUMNS",
    "cross_cylinder",
    "cross_plane",
    "dense_state",
    "inside_outline",
    "misses_box",
    "refine",
]

CYLINDER, RECTANGLE, POLYGON = 0, 1, 2
# a witness row: kind; box (6); centre or point (3); normal (3), or radius first; axes in the plane (3, 3); half sizes (2);
# first vertex and the one after the last
WITNESS_COLUMNS = 23
_BOX, _POINT, _NORMAL, _FIRST_AXIS, _SECOND_AXIS, _HALF, _VERTICES = 1, 7, 10, 13, 16, 19, 21

# binomials C(4,i) C(4,j) / C(8,i+j): the product of two polynomials of degree 4 in Bernstein form
_PRODUCT = np.array([[math.comb(4, i) * math.comb(4, j) / math.comb(8, i + j) for j in range(5)] for i in range(5)])


@njit(error_model="numpy")
def misses_box(points, row):
    """Tell whether the hull of the step's control points lies wholly off the witness's box."""
    for axis in range(3):
        p = points[axis]
        if max(max(p[0], p[1]), max(p[2], max(p[3], p[4]))) < row[_BOX + 2 * axis]:
            return True
        if min(min(p[0], p[1]), min(p[2], min(p[3], p[4]))) > row[_BOX + 2 * axis + 1]:
            return True
    return False


@njit(error_model="numpy")
def cross_plane(points, px, py, pz, nx, ny, nz, stack, roots):
    """Find the crossings of the plane through (px, py, pz) with the normal (nx, ny, nz); places on the step in `roots`."""
    coefficients = stack[0]
    scale = 0.0
    above = below = False
    for i in range(5):
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
    return sign_changes(stack, 4, scale, roots)


@njit(error_model="numpy")
def cross_cylinder(points, cx, cy, radius, stack, roots):
    """Find the crossings of the vertical cylinder about (cx, cy); places on the step in `roots`.

    Entering and leaving within one step, or touching, is found as on any other step: the squared distance from the axis is
    a polynomial of degree 8 whose sign changes are isolated.
    """
    coefficients = stack[0]
    squared = radius * radius
    outside = False
    for i in range(5):
        dx, dy = points[0, i] - cx, points[1, i] - cy
        if dx * dx + dy * dy >= squared:
            outside = True
    if not outside:
        return 0  # the hull lies inside the disc
    for k in range(9):
        coefficients[k] = 0.0
    scale = squared
    for i in range(5):
        dx, dy = points[0, i] - cx, points[1, i] - cy
        scale = max(scale, dx * dx + dy * dy)
        for j in range(5):
            coefficients[i + j] += _PRODUCT[i, j] * (dx * (points[0, j] - cx) + dy * (points[1, j] - cy))
    for k in range(9):
        coefficients[k] -= squared
    return sign_changes(stack, 8, scale, roots)


@njit(error_model="numpy")
def dense_state(points, theta, out):
    """Place and velocity (6,) of the dense output at theta in [0, 1]."""
    s = 1.0 - theta
    w0, w1, w2 = s * s * s * s, 4.0 * s * s * s * theta, 6.0 * s * s * theta * theta
    w3, w4 = 4.0 * s * theta * theta * theta, theta * theta * theta * theta
    for i in range(6):
        p = points[i]
        out[i] = w0 * p[0] + w1 * p[1] + w2 * p[2] + w3 * p[3] + w4 * p[4]


@njit(error_model="numpy")
def refine(state, slopes, h, theta, plane, radius, half_area_per_mass, around, trial, points, out):
    """State (6,) on the surface with the step's own order, from its crossing `theta` on the dense output.

    A step of size theta h ends beside the surface by the error of the dense output; a Taylor step along the path makes up for it.
    `plane` holds point and normal (6,); with `radius` above zero it is a vertical cylinder about that point instead.
    Where the path grazes the surface the dense output stands. Returns the time since the start of the step (s).
    """
    dense_state(points, theta, out)
    time = theta * h
    if time <= 0.0:
        return 0.0
    for i in range(3):
        trial[0, i] = slopes[0, i]
    take_step(state, trial, plane[6:12], time, half_area_per_mass, around)
    end = plane[6:12]
    if radius > 0.0:
        dx, dy = end[0] - plane[0], end[1] - plane[1]
        distance = math.sqrt(dx * dx + dy * dy)
        rate = (dx * end[3] + dy * end[4]) / distance if distance > 0.0 else 0.0
        gap = distance - radius
    else:
        gap = rate = 0.0
        for i in range(3):
            gap += plane[3 + i] * (end[i] - plane[i])
            rate += plane[3 + i] * end[3 + i]
    speed = math.sqrt(end[3] * end[3] + end[4] * end[4] + end[5] * end[5])
    if not abs(rate) > 1e-2 * speed:
        return time
    shift = -gap / rate
    if not abs(shift) <= 1e-2 * h:
        return time
    for i in range(3):
        slope = trial[6, i]
        out[i] = end[i] + shift * (end[3 + i] + 0.5 * shift * slope)
        out[3 + i] = end[3 + i] + shift * slope
    return time + shift


@njit(error_model="numpy")
def inside_outline(row, vertices, x, y, z):
    """Tell whether a place on a witness's plane or cylinder lies within its outline or height (edges belong to it)."""
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
        if (bi > b) != (bj > b):
            if a < vertices[i, 0] + (b - bi) * (vertices[j, 0] - vertices[i, 0]) / (bj - bi):
                inside = not inside
        j = i
    return inside
