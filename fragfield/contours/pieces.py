"""Points of a contour as few straight lines and circular arcs, within a tolerance."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


_FLATTEST = 5e3  # chords: a profile takes a flatter arc as a straight line
_SMALLEST_TURN = math.radians(25.0)  # between chords of a curve that is drawn as a polyline
_FEWEST_CHORDS = 5


@dataclass(frozen=True, eq=False)
class Pieces:
    """A contour as a profile has it: `stations`, `radii` (n,), signed radii of `arcs` (n - 1,), 0 straight (m)."""

    stations: Array
    radii: Array
    arcs: Array


def fitted(curves: Sequence[Array], tolerance: float) -> Pieces:
    """Lines and arcs through the ends of curves, from which no point and no chord's middle is farther than `tolerance`.

    Arcs of a drawing come back exactly, since their points lie on one circle.

    `curves` (n, 2): stations and radii (m), each curve smooth, stations increasing, each beginning where the one before
    ends; `tolerance`: in m.
    """
    points: list[Array] = []
    arcs: list[float] = []
    for curve in _runs(curves):
        start = 0
        while start < len(curve) - 1:
            end, arc = _farthest(curve, start, tolerance)
            points.append(curve[start])
            arcs.append(arc)
            start = end
        last = curve[-1]
    points.append(last)
    kept, radii = _straightened(np.array(points), arcs)
    return Pieces(kept[:, 0], kept[:, 1], np.array(radii))


def _runs(curves: Sequence[Array]) -> list[Array]:
    """Curves, those of many short chords that turn little from one to the next put together."""
    runs: list[Array] = []
    waiting: list[Array] = []

    def settle() -> None:
        if len(waiting) >= _FEWEST_CHORDS:
            runs.append(np.concatenate([waiting[0][:1], *(one[1:] for one in waiting)]))
        else:
            runs.extend(waiting)
        waiting.clear()

    for curve in curves:
        if len(curve) > 2:
            settle()
            runs.append(curve)
            continue
        if waiting and _turn(waiting[-1], curve) > _SMALLEST_TURN:
            settle()
        waiting.append(curve)
    settle()
    return runs


def _turn(one: Array, other: Array) -> float:
    (x0, y0), (x1, y1) = (one[1] - one[0]).tolist(), (other[1] - other[0]).tolist()
    return abs(math.atan2(x0 * y1 - y0 * x1, x0 * x1 + y0 * y1))


def _farthest(curve: Array, start: int, tolerance: float) -> tuple[int, float]:
    """The farthest point that one line or arc from `start` reaches, and its signed radius."""
    last = len(curve) - 1
    reached, arc = start + 1, 0.0
    step = 1
    while True:  # farther and farther, then back by halves
        end = min(start + 2 * step, last)
        found = _one_piece(curve[start : end + 1], tolerance)
        if found is None or end == last:
            break
        reached, arc, step = end, found, 2 * step
    if found is not None:
        return last, found
    low, high = reached, end
    while high - low > 1:
        middle = (low + high) // 2
        found = _one_piece(curve[start : middle + 1], tolerance)
        if found is None:
            high = middle
        else:
            low, arc = middle, found
    return low, arc


def _one_piece(points: Array, tolerance: float) -> float | None:
    """Signed radius of the line (0) or the arc that goes through points, None where none does."""
    chord = points[-1] - points[0]
    length = float(np.hypot(*chord))
    along = chord / length
    tested = np.concatenate([points, 0.5 * (points[1:] + points[:-1])])
    height = (tested - points[0]) @ np.array([-along[1], along[0]])
    if np.abs(height).max() <= 1e-3 * tolerance:
        return 0.0
    arc = _circle(points, length, along)
    if arc is not None and _off(tested, points, along, length, arc) <= tolerance:
        return arc
    return 0.0 if np.abs(height).max() <= tolerance else None


def _circle(points: Array, length: float, along: Array) -> float | None:
    """Signed radius of the arc through both ends and the point farthest from their chord."""
    outward = np.array([-along[1], along[0]])
    away = points - points[0]
    heights = away @ outward
    at = int(np.argmax(np.abs(heights)))
    height, foot = float(heights[at]), float(away[at] @ along)
    if at in (0, len(points) - 1) or height == 0.0:
        return None
    # Through (0, 0), (length, 0) and (foot, height): the centre's height over the chord.
    centre = (foot * (foot - length) + height**2) / (2.0 * height)
    radius = math.hypot(0.5 * length, centre)
    # The shorter arc bulges away from its centre; the longer one is no piece of a profile.
    if centre * height > 1e-9 * length**2 or radius > _FLATTEST * length:
        return None
    return _within(points, math.copysign(radius, height), length)


def _within(points: Array, arc: float, length: float) -> float | None:
    """The arc where it has one radius a station, its radius larger by rounding alone; None where it turns back."""
    smallest = length**2 / (2.0 * float(points[-1, 0] - points[0, 0]))  # with one end upright, half a chord or more
    if abs(arc) >= smallest:
        return arc
    return math.copysign(smallest * (1.0 + 1e-9), arc) if abs(arc) >= smallest * (1.0 - 1e-4) else None


def _off(tested: Array, points: Array, along: Array, length: float, arc: float) -> float:
    """Largest distance (m) of points from an arc."""
    outward = np.array([-along[1], along[0]])
    depth = math.sqrt(max(arc**2 - 0.25 * length**2, 0.0))
    centre = 0.5 * (points[0] + points[-1]) - math.copysign(depth, arc) * outward
    return float(np.abs(np.hypot(*(tested - centre).T) - abs(arc)).max())


def _straightened(points: Array, arcs: Sequence[float]) -> tuple[Array, list[float]]:
    """Points without those on a straight line between their neighbours."""
    kept, radii = [0], []
    for index in range(1, len(points) - 1):
        before, here, after = points[kept[-1]], points[index], points[index + 1]
        way, on = after - before, here - before
        off = abs(way[0] * on[1] - way[1] * on[0]) / max(float(np.hypot(*way)), 1e-300)
        if arcs[index - 1] == 0.0 and arcs[index] == 0.0 and off <= 1e-9:
            continue
        radii.append(arcs[index - 1])
        kept.append(index)
    radii.append(arcs[-1])
    kept.append(len(points) - 1)
    return points[kept], radii
