"""Polygons in plan: area, the points inside, the part on one side of a line. Corners (k, 2) in order, not closed."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


_SAME = 1e-9  # in the unit of the corners: nearer ones are one


def signed_area(corners: Array) -> float:
    """Area, positive where the corners run counter-clockwise."""
    x, y = corners.T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def contains(corners: Array, points: Array) -> NDArray[np.bool_]:
    """Whether points (n, 2) lie inside, by the even-odd rule (Shimrat 1962)."""
    inside = np.zeros(len(points), dtype=bool)
    x, y = points.T
    for (ax, ay), (bx, by) in zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True):
        crosses = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= crosses & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return inside


def clipped(corners: Array, axis: int, bound: float, side: float) -> Array:
    """The part with side * (coordinate - bound) >= 0 along an axis, 0 or 1 (Sutherland and Hodgman 1974).

    Of a polygon that is not convex the parts hang together by edges along the bound.
    """
    kept: list[Array] = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        here, there = side * (start[axis] - bound), side * (end[axis] - bound)
        if here >= 0.0:
            kept.append(start)
        if here * there < 0.0:
            kept.append(start + (end - start) * (here / (here - there)))
    made = np.array(kept).reshape(-1, 2)
    same = np.hypot(*(made - np.roll(made, 1, axis=0)).T) < _SAME if len(made) else np.zeros(0, dtype=bool)
    return made[~same]
