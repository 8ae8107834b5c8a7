"""Curves of a drawing in its plane, joined end to end: gaps closed, doubles left out, loose ends, and crossings."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

from fragfield.errors import InputError, nearest

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]


FINE = 0.05
"""Chords of a curve fall short of it by this share of the tolerance at most."""
_AXIS_NAME = re.compile(
    r"(^|[^a-z])(cl|axis|axes|achse|axe|eje|cent(er|re)[ _-]?lines?|mittellinie|rotachse)([^a-z]|$)"
)
_MOST_POINTS = 1 << 14  # of one curve


@dataclass(frozen=True, eq=False)
class Curve:
    """A smooth piece of a drawing: a line, an arc, a spline."""

    points: Array
    """(n, 2) float64: on the curve, from its start to its end (m), up is +y."""
    layer: str = ""
    """Its layer."""

    @property
    def is_straight(self) -> bool:
        """Whether it is a line between two points."""
        return len(self.points) == 2

    @property
    def length(self) -> float:
        """Length (m)."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())


@dataclass(frozen=True, eq=False)
class Sheet:
    """What a drawing holds."""

    curves: list[Curve]
    """Of the contour."""
    axes: list[Curve]
    """Lines that are drawn as centre lines."""
    unit: float
    """Length of one unit of the file (m)."""
    layers: dict[str, int] = field(default_factory=dict)
    """Number of curves by layer."""
    ignored: dict[str, int] = field(default_factory=dict)
    """Number of entities that are no contour, by what they are."""
    notes: list[str] = field(default_factory=list)
    """What was found, in words."""

    def place(self, x: float, y: float) -> str:
        """A position (m) in the file's coordinates, for messages."""
        return f"({x / self.unit + 0.0:.6g}, {y / self.unit + 0.0:.6g})"

    @property
    def points(self) -> Array:
        """All points of the contour (n, 2)."""
        return np.concatenate([one.points for one in self.curves])


def is_axis_name(name: str) -> bool:
    """Whether a layer or a label is called as centre lines are."""
    return _AXIS_NAME.search(name.casefold()) is not None


def folded(path: object, names: Iterable[str], known: set[str]) -> set[str]:
    """Names of layers in lower case; raises InputError for one that a drawing does not have."""
    for name in names:
        if name.casefold() not in {one.casefold() for one in known}:
            allowed = ", ".join(sorted(known)) or "none, without names"
            raise InputError(f'{path}: layers: found "{name}"{nearest(name, known)}; allowed: {allowed}')
    return {name.casefold() for name in names}


def counted(numbers: dict[str, int]) -> str:
    """Numbers by name, in words."""
    return ", ".join(f"{number} {name}" for name, number in sorted(numbers.items()))


def sampled(at: Callable[[Array], Sequence[Sequence[float]] | Iterable[Sequence[float]]], deviation: float) -> Array:
    """Points of a curve over its parameter, so many that no chord is farther from it than `deviation`.

    `at`: positions for parameters (n,) from 0 to 1; `deviation`: in the unit of the positions.
    """
    number = 8
    while True:
        fine = np.array([tuple(point)[:2] for point in at(np.linspace(0.0, 1.0, 2 * number + 1))], dtype=np.float64)
        points, middles = fine[::2], fine[1::2]
        chord = np.diff(points, axis=0)
        length = np.maximum(np.hypot(*chord.T), 1e-300)
        away = middles - points[:-1]
        off = np.abs(chord[:, 0] * away[:, 1] - chord[:, 1] * away[:, 0]) / length
        if off.max() <= deviation or number >= _MOST_POINTS:
            return points
        number *= 2


_MOST_CHECKED = 4000  # pieces of a chain whose crossings are looked for


@dataclass(frozen=True, eq=False)
class Chain:
    """Curves that follow each other, in (position along the axis, radius); `closed` where the last meets the first."""

    curves: tuple[Curve, ...]
    closed: bool

    @property
    def points(self) -> Array:
        """All points, those where curves meet once."""
        return np.concatenate([self.curves[0].points, *(one.points[1:] for one in self.curves[1:])])

    @property
    def layers(self) -> str:
        """Names of its layers."""
        return ", ".join(sorted({one.layer for one in self.curves})) or "none"


@dataclass(frozen=True, eq=False)
class Joined:
    """Chains of a half section, and what was mended: gaps that were closed, their largest (m), and doubles."""

    chains: list[Chain]
    gaps: int
    largest: float
    doubles: int


def above_axis(curves: Sequence[Curve], near: float) -> list[Curve]:
    """What lies above the axis: curves cut where they cross it, those on it left out, ends near it put on it."""
    kept = []
    for curve in curves:
        points = curve.points
        if np.abs(points[:, 1]).max() <= near:
            continue
        for piece in _cut(points):
            if piece[:, 1].max() <= near:
                continue
            piece = piece.copy()
            for end in (0, -1):
                if abs(piece[end, 1]) <= near:
                    piece[end, 1] = 0.0
            kept.append(Curve(piece, curve.layer))
    return kept


def _cut(points: Array) -> list[Array]:
    """Pieces of a curve between its crossings of the axis."""
    radius = points[:, 1]
    crossed = np.flatnonzero(radius[:-1] * radius[1:] < 0.0)
    pieces, first = [], points[:1]
    start = 0
    for index in crossed.tolist():
        share = radius[index] / (radius[index] - radius[index + 1])
        cut = points[index] + share * (points[index + 1] - points[index])
        cut = np.array([[cut[0], 0.0]])
        pieces.append(np.concatenate([first, points[start + 1 : index + 1], cut]))
        first, start = cut, index
    pieces.append(np.concatenate([first, points[start + 1 :]]))
    return pieces


def join(curves: Sequence[Curve], near: float, place: Callable[[Array], str]) -> Joined:
    """Chains of curves above the axis (`above_axis`), whose ends on it are not joined.

    Gaps up to `near` (m) are closed; `place` gives a position as it stands in the drawing, for messages. Raises
    InputError where three ends or more meet in a point.
    """
    single, doubles = _singles(curves, near)
    loops = [one for one in single if np.hypot(*(one.points[0] - one.points[-1])) <= near and one.length > 4.0 * near]
    open_ones = [one for one in single if all(one is not loop for loop in loops) and one.length > 0.0]
    ends = np.array([one.points[at] for one in open_ones for at in (0, -1)], dtype=np.float64).reshape(-1, 2)
    partner, gaps = _partners(ends, near, place, open_ones)
    chains = [Chain((one,), closed=True) for one in loops]
    unused = set(range(len(open_ones)))
    # Chains that begin at a loose end or on the axis first, then those that are closed.
    starts = [end for end in range(len(ends)) if partner[end] < 0] + list(range(0, len(ends), 2))
    for start in starts:
        if start // 2 not in unused:
            continue
        walked, end = [], start
        while end >= 0 and end // 2 in unused:
            curve = open_ones[end // 2]
            unused.remove(end // 2)
            walked.append(curve if end % 2 == 0 else Curve(curve.points[::-1], curve.layer))
            end = int(partner[end ^ 1])
        chains.append(Chain(_welded(walked, closed=end >= 0), closed=end >= 0))
    largest = max(gaps, default=0.0)
    return Joined(chains, sum(gap > 1e-3 * near for gap in gaps), largest, doubles)


def _singles(curves: Sequence[Curve], near: float) -> tuple[list[Curve], int]:
    """Curves without those that are there twice."""
    kept: list[Curve] = []
    for curve in curves:
        if not any(_same(curve, other, near) for other in kept):
            kept.append(curve)
    return kept, len(curves) - len(kept)


def _same(one: Curve, other: Curve, near: float) -> bool:
    if abs(one.length - other.length) > near:
        return False
    first, second = one.points[[0, len(one.points) // 2, -1]], other.points[[0, len(other.points) // 2, -1]]
    if len(one.points) == len(other.points):
        return any(np.abs(one.points - points).max() <= 0.1 * near for points in (other.points, other.points[::-1]))
    return any(np.abs(first - points).max() <= 0.1 * near for points in (second, second[::-1]))


def _partners(
    ends: Array, near: float, place: Callable[[Array], str], curves: Sequence[Curve]
) -> tuple[NDArray[np.int64], list[float]]:
    """For every end the one that it is joined to, -1 for none, and the gaps (m)."""
    from scipy.spatial import cKDTree

    partner = np.full(len(ends), -1, dtype=np.int64)
    gaps: list[float] = []
    if not len(ends):
        return partner, gaps
    tree = cKDTree(ends)
    for end in range(len(ends)):
        if ends[end, 1] == 0.0 or partner[end] >= 0:
            continue
        close = [other for other in tree.query_ball_point(ends[end], near) if other != end and ends[other, 1] != 0.0]
        apart = np.hypot(*(ends[close] - ends[end]).T)
        # Both ends of a curve shorter than a gap lie near each other: the other curve is meant.
        others = [other for other in close if other != end ^ 1]
        touching = [other for other, gap in zip(close, apart, strict=True) if gap <= 1e-3 * near and other != end ^ 1]
        chosen = touching or others
        if len(chosen) > 1:
            layers = ", ".join(sorted({curves[one // 2].layer for one in [end, *chosen]})) or "none"
            raise InputError(
                f"{len(chosen) + 1} lines meet at {place(ends[end])} (layers: {layers}); allowed: one contour; "
                "choose it by layers"
            )
        if chosen and partner[chosen[0]] < 0:
            partner[end], partner[chosen[0]] = chosen[0], end
            gaps.append(float(np.hypot(*(ends[chosen[0]] - ends[end]))))
    return partner, gaps


def _welded(curves: list[Curve], *, closed: bool) -> tuple[Curve, ...]:
    """Curves whose ends that meet are one point."""
    points = [one.points.copy() for one in curves]
    for number, here in enumerate(points):
        if number + 1 < len(points) or closed:
            later = points[(number + 1) % len(points)]
            middle = 0.5 * (here[-1] + later[0])
            here[-1], later[0] = middle, middle
    return tuple(Curve(one, curve.layer) for one, curve in zip(points, curves, strict=True))


def check_crossings(chain: Chain, place: Callable[[Array], str]) -> None:
    """Refuse a chain that crosses itself; raises InputError with the position."""
    points = chain.points
    count = len(points) - 1
    if not 3 <= count <= _MOST_CHECKED:
        return
    start, way = points[:-1], np.diff(points, axis=0)
    for index in range(count - 2):
        later = slice(index + 2, count - 1 if chain.closed and index == 0 else count)
        away, other = start[later] - start[index], way[later]
        cross = way[index, 0] * other[:, 1] - way[index, 1] * other[:, 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            here = (away[:, 0] * other[:, 1] - away[:, 1] * other[:, 0]) / cross
            there = (away[:, 0] * way[index, 1] - away[:, 1] * way[index, 0]) / cross
        inside = (here > 1e-9) & (here < 1.0 - 1e-9) & (there > 1e-9) & (there < 1.0 - 1e-9)
        if inside.any():
            share = float(here[np.flatnonzero(inside)[0]])
            raise InputError(
                f"the contour crosses itself at {place(start[index] + share * way[index])}; allowed: a simple line"
            )
