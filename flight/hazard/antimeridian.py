"""Lines and outlines cut where they cross 180 degrees of longitude, as RFC 7946 (3.1.9) asks and KML's angles need."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

from flight.scene.plan import clipped, signed_area

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["cut_line", "cut_outline"]


def cut_outline(ring: Array) -> list[Array]:
    """Parts of an outline between -180 and 180 degrees, each closed and counter-clockwise.

    `ring` (k, 2) holds longitudes that do not jump, and latitudes (degrees), the first point again at the end.
    """
    parts = []
    for shift in _turns(ring):
        kept = ring[:-1] - (shift, 0.0)
        for bound in (-180.0, 180.0):
            kept = clipped(kept, 0, bound, -math.copysign(1.0, bound)) if len(kept) else kept
        area = signed_area(kept - kept[0]) if len(kept) > 2 else 0.0  # it is small beside the longitudes
        if area != 0.0:
            kept = np.clip(kept if area > 0.0 else kept[::-1], -180.0, 180.0)  # rounding
            parts.append(np.concatenate([kept, kept[:1]]))
    return parts


def cut_line(line: Array) -> list[Array]:
    """Parts of a line between -180 and 180 degrees; a line of one point is that point there."""
    if len(line) == 1:
        return [line - (_turns(line)[0], 0.0)]
    parts: list[list[Array]] = []
    for shift in _turns(line):
        last = None
        for start, end in pairwise(line - (shift, 0.0)):
            low, high = sorted((float(start[0]), float(end[0])))
            if high <= -180.0 or low >= 180.0:
                continue
            first, after = _bounded(start, end), _bounded(end, start)
            if last is None or not np.array_equal(last, first):
                parts.append([first])
            parts[-1].append(after)
            last = after
    return [np.array(part) for part in parts]


def _turns(points: Array) -> list[float]:
    """Whole turns (degrees) by which parts of points lie off -180 to 180."""
    low, high = (math.floor((value + 180.0) / 360.0) for value in (points[:, 0].min(), points[:, 0].max()))
    if high > low and points[:, 0].max() == 360.0 * high - 180.0:
        high -= 1  # only touches
    return [360.0 * turn for turn in range(low, high + 1)]


def _bounded(point: Array, other: Array) -> Array:
    """A point, or where the line to the other one comes within -180 and 180 degrees."""
    bound = min(max(float(point[0]), -180.0), 180.0)
    share = 0.0 if bound == point[0] else (bound - point[0]) / (other[0] - point[0])
    return np.array([bound, point[1] + share * (other[1] - point[1])])
