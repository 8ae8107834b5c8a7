"""Outlines of places: convex parts of an area, and the box around a building."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np

from flight.scene.plan import signed_area
from fragfield.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


Box = tuple[tuple[float, float], float, float, float]
"""Centre, length, width (m) and direction of the length from +x (degrees)."""
_ALIKE = 1e-3  # of the area: by which a convex hull may be larger
_NEAR = 0.02  # m: a corner nearer to the line between its neighbours is none
_MOST = 2000  # corners


def _hull(corners: Array) -> Array:
    from scipy.spatial import ConvexHull, QhullError

    try:
        return corners[ConvexHull(corners).vertices]
    except QhullError:
        raise InputError(
            "found an outline without area; allowed: three corners or more that are not on a line"
        ) from None


def box_around(corners: Array) -> tuple[Box, float]:
    """The smallest box around corners (n, 2) in m, and how much larger than the outline it is, as a fraction."""
    hull = _hull(corners)
    best: tuple[float, Box] | None = None
    for start, end in zip(hull, np.roll(hull, -1, axis=0), strict=True):
        along = (end - start) / math.hypot(*(end - start))
        across = np.array([-along[1], along[0]])
        u, v = hull @ along, hull @ across
        length, width = float(np.ptp(u)), float(np.ptp(v))
        centre = 0.5 * (u.min() + u.max()) * along + 0.5 * (v.min() + v.max()) * across
        turn = math.degrees(math.atan2(along[1], along[0]))
        if width > length:
            length, width, turn = width, length, turn + 90.0
        if best is None or length * width < best[0] * (1.0 - 1e-9):
            best = length * width, ((float(centre[0]), float(centre[1])), length, width, turn % 180.0)
    assert best is not None
    return best[1], best[0] / max(abs(signed_area(corners)), 1e-9) - 1.0


def convex_parts(corners: Array) -> list[Array]:
    """Convex polygons that make up an outline, by cutting ears off it and joining what stays convex.

    Raises InputError: the outline has no area or crosses itself.
    """
    hull = _hull(corners)
    if abs(signed_area(hull)) <= abs(signed_area(corners)) * (1.0 + _ALIKE):
        return [hull]
    ring = corners if signed_area(corners) > 0.0 else corners[::-1]
    ring = ring[_bends(ring)]
    if _crosses(ring):
        raise InputError("found an outline that crosses itself; allowed: a simple one")
    if len(ring) > _MOST:
        raise InputError(f"found an outline of {len(ring)} corners that is not convex; allowed: {_MOST}")
    parts = [list(one) for one in _ears(ring)]
    joined = True
    while joined:
        joined = False
        for first in range(len(parts)):
            for second in range(first + 1, len(parts)):
                whole = _together(ring, parts[first], parts[second])
                if whole is not None:
                    parts[first] = whole
                    del parts[second]
                    joined = True
                    break
            if joined:
                break
    return [_hull(ring[part]) for part in parts]


def _bends(ring: Array) -> NDArray[np.bool_]:
    before, after = np.roll(ring, 1, axis=0), np.roll(ring, -1, axis=0)
    way, on = after - before, ring - before
    length = np.maximum(np.hypot(*way.T), 1e-9)
    return np.abs(way[:, 0] * on[:, 1] - way[:, 1] * on[:, 0]) / length > _NEAR


def _crosses(ring: Array) -> bool:
    """Whether two sides of an outline cross."""
    way = np.roll(ring, -1, axis=0) - ring
    away = ring[None] - ring[:, None]
    cross = way[:, None, 0] * way[None, :, 1] - way[:, None, 1] * way[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        here = (away[..., 0] * way[None, :, 1] - away[..., 1] * way[None, :, 0]) / cross
    inside = (here > 1e-9) & (here < 1.0 - 1e-9)
    return bool((inside & inside.T).any())


def _ears(ring: Array) -> list[tuple[int, int, int]]:
    """Triangles of a simple outline that runs counter-clockwise (Meisters 1975)."""
    left, made = list(range(len(ring))), []
    while len(left) > 3:
        for place in range(len(left)):
            before, here, after = left[place - 1], left[place], left[(place + 1) % len(left)]
            others = [one for one in left if one not in (before, here, after)]
            if _turn(ring[before], ring[here], ring[after]) > 0.0 and not any(
                _inside(ring[one], ring[before], ring[here], ring[after]) for one in others
            ):
                made.append((before, here, after))
                del left[place]
                break
        else:
            raise InputError("found an outline that crosses itself; allowed: a simple one")
    made.append((left[0], left[1], left[2]))
    return made


def _turn(one: Array, two: Array, three: Array) -> float:
    return float((two[0] - one[0]) * (three[1] - one[1]) - (two[1] - one[1]) * (three[0] - one[0]))


def _inside(point: Array, one: Array, two: Array, three: Array) -> bool:
    return min(_turn(one, two, point), _turn(two, three, point), _turn(three, one, point)) >= 0.0


def _together(ring: Array, one: list[int], other: list[int]) -> list[int] | None:
    """Corners of two parts that share a side, where they are convex together."""
    for place in range(len(one)):
        start, end = one[place], one[(place + 1) % len(one)]
        for step in range(len(other)):
            if other[step] == end and other[(step + 1) % len(other)] == start:
                whole = (
                    one[: place + 1]
                    + [other[(step + 2 + k) % len(other)] for k in range(len(other) - 2)]
                    + one[place + 1 :]
                )
                corners = ring[whole]
                turns = [_turn(corners[k - 2], corners[k - 1], corners[k]) for k in range(len(whole))]
                return whole if min(turns) >= 0.0 else None
    return None
