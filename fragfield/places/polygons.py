"""Outlines of places: convex parts of an area, and the box around a building."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fragfield.errors import InputError

if TYPE_CHECKING:
    from shapely import Polygon

Array = NDArray[np.float64]


Box = tuple[tuple[float, float], float, float, float]
"""Centre, length, width (m) and direction of the length from +x (degrees)."""
_ALIKE = 1e-3  # of the area: by which a convex hull may be larger
_NEAR = 0.02  # m: a corner nearer to the line between its neighbours is none
_MOST = 500  # corners


def _outline(corners: Array) -> Polygon:
    import shapely

    outline = shapely.Polygon(corners) if len(corners) > 2 else shapely.Polygon()
    if not outline.convex_hull.area > 0.0:
        raise InputError("found an outline without area; allowed: three corners or more that are not on a line")
    return outline


def box_around(corners: Array) -> tuple[Box, float]:
    """The smallest box around corners (n, 2) in m, and how much larger than the outline it is, as a fraction."""
    outline = _outline(corners)
    hull = np.array(outline.convex_hull.exterior.coords)
    # One of its sides lies along one of the hull's.
    along = np.diff(hull, axis=0) / np.hypot(*np.diff(hull, axis=0).T)[:, None]
    across = np.column_stack([-along[:, 1], along[:, 0]])
    low, high = (np.stack([edge(hull @ way.T, axis=0) for way in (along, across)]) for edge in (np.min, np.max))
    sides = high - low
    best = int(np.argmin(np.round(sides.prod(axis=0), 9)))
    centre = 0.5 * (low + high)[:, best] @ np.array([along[best], across[best]])
    turn = math.degrees(math.atan2(along[best, 1], along[best, 0])) + (90.0 if sides[1, best] > sides[0, best] else 0.0)
    width, length = sorted(sides[:, best].tolist())
    return ((float(centre[0]), float(centre[1])), length, width, turn % 180.0), length * width / outline.area - 1.0


def convex_parts(corners: Array) -> list[Array]:
    """Convex polygons, counter-clockwise, that make up an outline: triangles joined while they stay convex.

    Raises InputError: the outline has no area or crosses itself.
    """
    import shapely

    outline = _outline(corners)
    parts = [outline]
    if outline.convex_hull.area > outline.area * (1.0 + _ALIKE):
        if not outline.is_valid:
            raise InputError("found an outline that crosses itself; allowed: a simple one")
        outline = outline.simplify(_NEAR)
        if len(outline.exterior.coords) > _MOST:
            raise InputError(f"found an outline of more than {_MOST} corners that is not convex; allowed: {_MOST}")
        parts = list(shapely.get_parts(shapely.constrained_delaunay_triangles(outline)))
    first = 0
    while first < len(parts):
        for other in range(first + 1, len(parts)):
            whole = parts[first].union(parts[other])
            if whole.convex_hull.area <= whole.area * (1.0 + 1e-9):
                parts[first] = whole
                del parts[other]
                break
        else:
            first += 1
    return [np.array(shapely.geometry.polygon.orient(one.convex_hull).exterior.coords)[:-1] for one in parts]
