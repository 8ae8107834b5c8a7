"""Lines and outlines cut where they cross 180 degrees of longitude, as RFC 7946 (3.1.9) asks and KML's angles need."""

from __future__ import annotations

import math
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["cut_line", "cut_outline"]


def cut_outline(ring: Array) -> list[Array]:
    """Parts of an outline between -180 and 180 degrees, each closed and counter-clockwise.

    Parameters
    ----------
    ring : (k, 2) float64
        Longitudes that do not jump, and latitudes (degrees), the first point again at the end.
    """
    parts = []
    for shift in _turns(ring):
        kept = [ring - (shift, 0.0)]
        for side in (-1.0, 1.0):
            kept = [part for one in kept for part in _beside(one, side * 180.0, side)]
        parts += kept
    return [part if _area(part) > 0.0 else part[::-1] for part in parts if _area(part) != 0.0]


def cut_line(line: Array) -> list[Array]:
    """Parts of a line between -180 and 180 degrees; a line of one point is that point there."""
    if len(line) == 1:
        return [line - (next(iter(_turns(line))), 0.0)]
    parts = []
    for shift in _turns(line):
        moved = line - (shift, 0.0)
        part: list[Array] = []
        for start, end in pairwise(moved):
            inside = _within(start, end)
            if inside is None:
                continue
            first, last = inside
            if not part or not np.array_equal(part[-1], first):
                if len(part) > 1:
                    parts.append(np.array(part))
                part = [first]
            part.append(last)
        if len(part) > 1:
            parts.append(np.array(part))
    return parts


def _turns(points: Array) -> list[float]:
    """Whole turns (degrees) by which parts of points lie off -180 to 180."""
    low, high = (math.floor((value + 180.0) / 360.0) for value in (points[:, 0].min(), points[:, 0].max()))
    if high > low and points[:, 0].max() == 360.0 * high - 180.0:
        high -= 1  # only touches
    return [360.0 * turn for turn in range(low, high + 1)]


def _within(start: Array, end: Array) -> tuple[Array, Array] | None:
    """The piece of a line between two points that lies between -180 and 180 degrees."""
    low, high = sorted((float(start[0]), float(end[0])))
    if high <= -180.0 or low >= 180.0:
        return None
    ends = []
    for point, other in ((start, end), (end, start)):
        bound = min(max(float(point[0]), -180.0), 180.0)
        share = 0.0 if bound == point[0] else (bound - point[0]) / (other[0] - point[0])
        ends.append(np.array([bound, point[1] + share * (other[1] - point[1])]))
    return ends[0], ends[1]


def _beside(ring: Array, bound: float, side: float) -> list[Array]:
    """Parts of a closed outline with side * (longitude - bound) <= 0.

    Its pieces between crossings of the meridian are joined along it: of the crossings, in the order of their latitudes,
    the first and the second lie on one part's border, the third and the fourth, and so on.
    """
    away = side * (ring[:, 0] - bound)
    if away.max() <= 0.0:
        return [ring]
    if away.min() >= 0.0:
        return []
    first = int(np.argmax(away > 0.0))  # begin outside
    points, away = np.roll(ring[:-1], -first, axis=0), np.roll(away[:-1], -first)
    pieces: list[list[Array]] = []
    for index in range(len(points)):
        after = (index + 1) % len(points)
        if away[index] > 0.0 >= away[after]:
            pieces.append([_crossing(points[index], points[after], away[index], away[after])])
        if (away[after] <= 0.0 and pieces and away[index] <= 0.0) or away[index] > 0.0 >= away[after]:
            pieces[-1].append(points[after])
        if away[index] <= 0.0 < away[after]:
            pieces[-1].append(_crossing(points[index], points[after], away[index], away[after]))
    ends = [(float(piece[at][1]), number, at) for number, piece in enumerate(pieces) for at in (0, -1)]
    ends.sort()
    partner = {}
    for one, other in zip(ends[::2], ends[1::2], strict=True):
        partner[one[1:]], partner[other[1:]] = other[1:], one[1:]
    made, left = [], set(range(len(pieces)))
    while left:
        start = min(left)
        whole: list[Array] = []
        number = start
        while number in left:
            left.remove(number)
            whole += pieces[number]
            number = partner[(number, -1)][0]
        closed = np.array([*whole, whole[0]])
        closed[np.abs(closed[:, 0] - bound) < 1e-12, 0] = bound
        made.append(closed)
    return made


def _crossing(start: Array, end: Array, before: float, after: float) -> Array:
    return start + before / (before - after) * (end - start)


def _area(ring: Array) -> float:
    x, y = (ring - ring[0]).T  # small beside the longitudes
    return 0.5 * float(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1]))
