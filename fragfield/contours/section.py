"""Outer contour and cavity of a casing from the curves of its section, one half of it or both."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fragfield.errors import InputError, nearest

if TYPE_CHECKING:
    from shapely import LineString


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

    @cached_property
    def line(self) -> LineString:
        """Its points as shapely has them."""
        import shapely

        return shapely.LineString(self.points)

    @property
    def length(self) -> float:
        """Length (m)."""
        return float(self.line.length)


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


Array = NDArray[np.float64]


_STEP = 2.0  # tolerances: the length of the cone that stands for a step in radius
_COMPARED = 400  # stations at which two halves are compared
_FEWEST = 0.02  # of the length: a shorter chain is a mark, not a contour


@dataclass(frozen=True, eq=False)
class Section:
    """Outer contour and cavity of a casing: stations from the nose end and radii (n, 2) in m; what was mended."""

    outer: Array
    cavity: Array
    notes: list[str]


def casing_section(
    curves: Sequence[Curve], *, nose: float, sign: float, tolerance: float, near: float, place: Callable[[Array], str]
) -> Section:
    """The section of a casing.

    `curves`: in positions along the axis and distances from it (m), as of `read.turned`; on one side of the axis or on
    both; `nose`, `sign`: position of the nose end along the axis (m), and the sign with which stations run from there;
    `tolerance`, `near`: by which a contour may be off, and the largest gap that is closed (m); `place`: a position
    along the axis and its distance from it as they stand in the drawing, for messages. Raises InputError: loose ends,
    crossings, undercuts, no cavity, more than one contour, or halves that differ.
    """
    sections = []
    for side in (1.0, -1.0):
        upper = list(_above_axis([Curve(one.points * (1.0, side), one.layer) for one in curves], near))
        if upper:
            half = _Half(upper, near, lambda at, side=side: place(at * (1.0, side)))  # type: ignore[misc]
            sections.append(half.section(nose, sign, tolerance))
    if not sections:
        raise InputError("found only lines on the axis; allowed: the outline of a casing beside it")
    first = sections[0]
    if len(sections) == 2:
        off, station = _difference(sections[0], sections[1])
        if off > near:
            raise InputError(
                f"the two halves differ by {1e3 * off:.4g} mm at station {1e3 * station:.6g} mm; "
                f"allowed: up to {1e3 * near:g} mm; correct the drawing, or choose one half by layers"
            )
        words = f"both halves are drawn and differ by {1e3 * off:.2g} mm at most; the upper or right one is taken"
        return Section(first.outer, first.cavity, [words, *first.notes])
    return first


def _above_axis(curves: Sequence[Curve], near: float) -> Iterator[Curve]:
    """What lies above the axis: curves cut where they cross it, those on it left out, ends near it put on it."""
    import shapely

    for curve in curves:
        (left, _), (right, top) = curve.points.min(axis=0), curve.points.max(axis=0)
        if top <= near:
            continue
        for piece in shapely.get_parts(
            shapely.clip_by_rect(shapely.LineString(curve.points), left - 1, 0, right + 1, top + 1)
        ):
            points = shapely.get_coordinates(piece)
            if points[:, 1].max() > near:
                points[[0, -1], 1] = np.where(points[[0, -1], 1] <= near, 0.0, points[[0, -1], 1])
                yield Curve(points, curve.layer)


class _Half:
    """Curves above the axis, joined to chains; ends on the axis are not joined.

    Gaps up to `near` (m) are closed; `place` gives a position as it stands in the drawing, for messages. Raises
    InputError where three ends or more meet in a point, or a chain crosses itself.
    """

    def __init__(self, curves: Sequence[Curve], near: float, place: Callable[[Array], str]) -> None:
        import shapely

        self.near, self.place, self.notes = near, place, list[str]()
        single: list[Curve] = []
        for curve in curves:
            if not any(
                abs(curve.length - other.length) <= near
                and shapely.hausdorff_distance(curve.line, other.line) <= 0.1 * near
                for other in single
            ):
                single.append(curve)
        self.curves = single
        self.corners: set[tuple[float, ...]] = set()
        touching, _ = self._welded([one.points for one in single], 1e-3 * near)
        joined, gaps = self._welded(touching, near)
        length = float(np.ptp(np.concatenate([one.points for one in single])[:, 0]))
        lines = [shapely.LineString(one) for one in joined]
        kept = [one.length > _FEWEST * length or (one.is_closed and one.length > 4.0 * near) for one in lines]
        self.chains = [one for one, is_kept in zip(lines, kept, strict=True) if is_kept]
        if gaps:
            self.notes.append(f"{len(gaps)} gaps closed, the largest of {1e3 * max(gaps):.2g} mm")
        if len(curves) > len(single):
            self.notes.append(f"{len(curves) - len(single)} lines that were there twice left out")
        if not all(kept):
            self.notes.append(f"{len(kept) - sum(kept)} short marks left out")
        for chain in self.chains:
            if not chain.is_simple:
                drawn = set(chain.coords)
                nodes = [one for one in shapely.get_coordinates(shapely.unary_union(chain)) if tuple(one) not in drawn]
                where = f" at {place(nodes[0])}" if nodes else ""
                raise InputError(f"the contour crosses itself{where}; allowed: a simple line")

    def _welded(self, lines: Sequence[Array], distance: float) -> tuple[list[Array], list[float]]:
        """Lines merged where their ends off the axis lie within a distance, at the middle, and the gaps there (m)."""
        import shapely
        from scipy.sparse import coo_array
        from scipy.sparse.csgraph import connected_components
        from scipy.spatial import cKDTree

        lines = [one.copy() for one in lines]
        ends = np.array([line[at] for line in lines for at in (0, -1)])
        loose = np.flatnonzero(ends[:, 1] != 0.0)
        gaps = []
        if len(loose):
            pairs = cKDTree(ends[loose]).query_pairs(distance, output_type="ndarray")
            links = coo_array((np.ones(len(pairs)), (pairs[:, 0], pairs[:, 1])), shape=(len(loose), len(loose)))
            number, cluster = connected_components(links, directed=False)
            for group in range(number):
                touching = loose[cluster == group]
                if len(touching) > 2:
                    raise InputError(
                        f"{len(touching)} lines meet at {self.place(ends[touching[0]])} (layers: "
                        f"{self._layers(shapely.Point(ends[touching[0]]))}); allowed: one contour; choose it by layers"
                    )
                if len(touching) == 2:
                    gaps.append(float(np.hypot(*(ends[touching[1]] - ends[touching[0]]))))
                    for end in touching:
                        lines[end // 2][-(end % 2)] = ends[touching].mean(axis=0)
        self.corners |= {tuple(line[at]) for line in lines for at in (0, -1)}
        merged = shapely.get_parts(shapely.line_merge(shapely.MultiLineString(lines)))
        return [shapely.get_coordinates(one) for one in merged], gaps

    def _layers(self, where: object) -> str:
        return ", ".join(sorted({one.layer for one in self.curves if one.line.distance(where) <= self.near})) or "none"

    def _loose(self) -> str:
        """The nearest two loose ends, which may be a gap."""
        ends = np.array([chain.coords[at] for chain in self.chains if not chain.is_closed for at in (0, -1)]).reshape(
            -1, 2
        )
        ends = ends[ends[:, 1] != 0.0]
        if len(ends) < 2:
            return ""
        apart = np.hypot(*(ends[:, None] - ends[None]).T)
        np.fill_diagonal(apart, np.inf)
        one, other = np.unravel_index(int(np.argmin(apart)), apart.shape)
        closed = f"up to {1e3 * self.near:g} mm are closed"
        gap = f"{1e3 * float(apart[one, other]):.4g} mm apart, at {self.place(ends[min(one, other)])} ({closed})"
        return f"; the nearest loose ends are {gap}"

    def section(self, nose: float, sign: float, tolerance: float) -> Section:
        """Outer contour and cavity, stations from the nose."""
        made = []
        here = lambda at: self.place(np.array([nose + sign * at[0], at[1]]))  # noqa: E731
        for name, parts in zip(("outer contour", "cavity"), self._two_lines(), strict=True):
            stations = [np.column_stack([sign * (one[:, 0] - nose), one[:, 1]]) for one in parts]
            try:
                made.append(chords(_monotone(name, stations, tolerance, self.near, here), tolerance))
            except InputError as fault:
                raise InputError(f"{fault}{self._loose()}") from None
        return Section(made[0], made[1], self.notes)

    def _two_lines(self) -> tuple[list[Array], list[Array]]:
        chains, near = self.chains, self.near
        if len(chains) > 2 or (len(chains) == 2 and any(one.is_closed for one in chains)):
            listed = "; ".join(
                f"{'a closed' if one.is_closed else 'an open'} one on "
                f"{self._layers(one.interpolate(0.5, normalized=True))} from {self.place(np.array(one.coords[0]))}"
                for one in chains
            )
            raise InputError(
                f"found {len(chains)} outlines ({listed}); allowed: the outline of the casing, or its outer and its "
                f"inner line; choose them by layers{self._loose()}"
            )
        if len(chains) == 2:
            inner, outer = (np.array(one.coords) for one in sorted(chains, key=lambda one: one.bounds[3]))
            for point in inner[[0, -1]]:
                if point[1] != 0.0 and np.abs(outer[[0, -1], 0] - point[0]).min() > near:
                    raise InputError(
                        f"the inner line ends at {self.place(point)}, neither on the axis nor at an end of the "
                        f"casing{self._loose()}; allowed: a closed outline, or a line drawn on to the axis where the "
                        "cavity ends"
                    )
            return self._pieces(outer), self._pieces(inner)
        ring = np.array(chains[0].coords)
        ends = ring[[0, -1]]
        if not chains[0].is_closed and not np.all(ends[:, 1] == 0.0):
            apart = 1e3 * float(np.hypot(*(ends[1] - ends[0])))
            raise InputError(
                f"the outline is open between {self.place(ends[0])} and {self.place(ends[1])}, {apart:.4g} mm "
                f"apart; allowed: gaps up to {1e3 * near:g} mm; close it, or draw its outer and its inner line"
            )
        return self._split(ring[:-1] if abs(ends[0, 0] - ends[1, 0]) <= near else ring)

    def _pieces(self, points: Array) -> list[Array]:
        inner = [at for at in range(1, len(points) - 1) if tuple(points[at]) in self.corners]
        return [points[start : end + 1] for start, end in pairwise([0, *inner, len(points) - 1])]

    def _split(self, ring: Array) -> tuple[list[Array], list[Array]]:
        """A casing's outline cut at its two ends into its outer and its inner line."""
        station = ring[:, 0]
        ends = np.array([station.min(), station.max()])
        step = np.diff(station, append=station[:1])
        is_end = np.abs(station[:, None] - ends).min(axis=1) <= 1e-3 * self.near  # of a smooth curve
        is_corner = np.array([tuple(one) in self.corners for one in ring]) | (is_end & (step * np.roll(step, 1) <= 0.0))
        at = np.flatnonzero(is_corner)
        tops, feet = [], []
        for end in ends:
            there = at[np.abs(station[at] - end) <= self.near]
            tops.append(int(there[np.argmax(ring[there, 1])]))
            feet.append(int(there[np.argmin(ring[there, 1])]))

        def path(start: int, end: int, avoided: Sequence[int]) -> list[Array]:
            """The way from one corner to another that passes none of the avoided corners within."""
            forward = np.arange(start, start + (end - start) % len(ring) + 1) % len(ring)
            if set(forward[1:-1].tolist()) & set(avoided):
                forward = np.arange(start, start - (start - end) % len(ring) - 1, -1) % len(ring)
            cuts = [0, *(np.flatnonzero(is_corner[forward[1:-1]]) + 1).tolist(), len(forward) - 1]
            return [ring[forward[first : last + 1]] for first, last in pairwise(cuts)]

        return path(tops[0], tops[1], feet), path(feet[0], feet[1], tops)


def _monotone(
    name: str, parts: Sequence[Array], tolerance: float, near: float, place: Callable[[Array], str]
) -> list[Array]:
    """Smooth pieces of a line, stations increasing: ends across the axis left out, steps as short cones."""
    if parts and parts[0][0, 0] > parts[-1][-1, 0]:
        parts = [one[::-1] for one in reversed(parts)]
    kept = list(parts)
    for end in (0, -1):  # without its ends on the axis, and without faces across the axis there
        while kept and (kept[end][:, 1].max() <= near or np.ptp(kept[end][:, 0]) <= 1e-2 * near):
            kept.pop(end)
    if not kept:
        raise InputError(f"found no {name}: the outline encloses no hollow; allowed: a casing with a cavity")
    made: list[Array] = []
    for part in kept:
        forward = np.maximum.accumulate(part[:, 0])
        if (forward - part[:, 0]).max() > tolerance:
            worst = int(np.argmax(forward - part[:, 0]))
            raise InputError(
                f"the {name} runs back along the axis at {place(part[worst])}, by "
                f"{1e3 * (forward - part[:, 0]).max():.4g} mm; allowed: one radius a station, undercuts left out"
            )
        if np.ptp(part[:, 0]) <= tolerance:  # a step in radius
            made.append(np.array([[part[0, 0], part[0, 1]], [part[0, 0], part[-1, 1]]]))
        else:
            rising = np.concatenate([[True], np.diff(forward) > 0.0])
            made.append(np.column_stack([forward, part[:, 1]])[rising])
    return with_cones(made, 0.5 * _STEP * tolerance)


def with_cones(parts: Sequence[Array], half: float) -> list[Array]:
    """Smooth parts that follow each other, every step in radius as a cone about its station, `half` its length."""
    made: list[Array] = []
    for part in parts:
        if part[-1, 0] > part[0, 0]:
            if made:  # it begins where the last one ends
                part = np.concatenate([made[-1][-1:], part[part[:, 0] > made[-1][-1, 0] + 1e-9]])
            if len(part) > 1:
                made.append(part)
        elif made and abs(part[-1, 1] - part[0, 1]) > 1e-9:
            before, at = made[-1], float(part[0, 0])
            start = np.array([[at - half, np.interp(at - half, *before.T)]])
            made[-1] = np.concatenate([before[before[:, 0] < at - half], start])
            made.append(np.concatenate([start, [[at + half, part[-1, 1]]]]))
    return made


def chords(parts: Sequence[Array], tolerance: float) -> Array:
    """Corners of few chords (Douglas and Peucker's way) within `tolerance` (m) of the points of parts that join."""
    import shapely

    points = np.concatenate([parts[0][:1], *(one[1:] for one in parts)])
    return shapely.get_coordinates(shapely.simplify(shapely.LineString(points), tolerance, preserve_topology=False))


def _difference(one: Section, other: Section) -> tuple[float, float]:
    worst = (0.0, 0.0)
    for first, second in ((one.outer, other.outer), (one.cavity, other.cavity)):
        ends = float(np.abs(first[[0, -1], 0] - second[[0, -1], 0]).max())
        worst = max(worst, (ends, float(first[0, 0])))
        at = np.linspace(max(first[0, 0], second[0, 0]), min(first[-1, 0], second[-1, 0]), _COMPARED)
        off = np.abs(np.interp(at, *first.T) - np.interp(at, *second.T))
        worst = max(worst, (float(off.max()), float(at[int(np.argmax(off))])))
    return worst
