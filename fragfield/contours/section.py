"""Outer contour and cavity of a casing from the curves of its section, one half of it or both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from fragfield.contours.curves import Chain, Curve, above_axis, check_crossings, join
from fragfield.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from fragfield.contours.curves import Joined

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

    `curves`: in positions along the axis and distances from it (m), as of `axis.turned`; on one side of the axis or on
    both; `nose`, `sign`: position of the nose end along the axis (m), and the sign with which stations run from there;
    `tolerance`, `near`: by which a contour may be off, and the largest gap that is closed (m); `place`: a position
    along the axis and its distance from it as they stand in the drawing, for messages. Raises InputError: loose ends,
    crossings, undercuts, no cavity, more than one contour, or halves that differ.
    """
    halves = []
    for side in (1.0, -1.0):
        upper = above_axis([_mirrored(one, side) for one in curves], near)
        if upper:
            halves.append((side, upper))
    if not halves:
        raise InputError("found only lines on the axis; allowed: the outline of a casing beside it")
    sections = []
    for side, upper in halves:
        sections.append(_half(upper, nose, sign, tolerance, near, _on_side(place, side)))
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


def _on_side(place: Callable[[Array], str], side: float) -> Callable[[Array], str]:
    return lambda at: place(at * (1.0, side))


def _mirrored(curve: Curve, side: float) -> Curve:
    return curve if side > 0.0 else Curve(curve.points * (1.0, -1.0), curve.layer)


def _half(
    upper: Sequence[Curve], nose: float, sign: float, tolerance: float, near: float, place: Callable[[Array], str]
) -> Section:
    joined = join(upper, near, place)
    length = float(np.ptp(np.concatenate([one.points for one in upper])[:, 0]))
    chains = [
        one for one in joined.chains if one.closed or sum(curve.length for curve in one.curves) > _FEWEST * length
    ]
    for chain in chains:
        check_crossings(chain, place)
    outer, cavity = _two_lines(chains, near, place)
    made = []
    for name, line in (("outer contour", outer), ("cavity", cavity)):
        stations = [
            Curve(np.column_stack([sign * (one.points[:, 0] - nose), one.points[:, 1]]), one.layer) for one in line
        ]
        here = lambda at: place(np.array([nose + sign * at[0], at[1]]))  # noqa: E731
        try:
            made.append(_monotone(name, stations, tolerance, near, here))
        except InputError as fault:
            raise InputError(f"{fault}{_loose_words(chains, near, place)}") from None
    return Section(chords(made[0], tolerance), chords(made[1], tolerance), list(_mended(joined, chains)))


def _mended(joined: Joined, chains: Sequence[Chain]) -> list[str]:
    notes = []
    if joined.gaps:
        notes.append(f"{joined.gaps} gaps closed, the largest of {1e3 * joined.largest:.2g} mm")
    if joined.doubles:
        notes.append(f"{joined.doubles} lines that were there twice left out")
    if short := len(joined.chains) - len(chains):
        notes.append(f"{short} short marks left out")
    return notes


def _two_lines(chains: Sequence[Chain], near: float, place: Callable[[Array], str]) -> tuple[list[Curve], list[Curve]]:
    """Curves of the outer contour and of the cavity."""
    listed = "; ".join(f"{_kind(one)} on {one.layers} from {place(one.points[0])}" for one in chains)
    if len(chains) > 2 or (len(chains) == 2 and any(one.closed for one in chains)):
        raise InputError(
            f"found {len(chains)} outlines ({listed}); allowed: the outline of the casing, or its outer and its "
            f"inner line; choose them by layers{_loose_words(chains, near, place)}"
        )
    if len(chains) == 2:
        inner, outer = sorted(chains, key=lambda chain: float(chain.points[:, 1].max()))
        _check_ends(inner, outer, near, place, _loose_words(chains, near, place))
        return list(outer.curves), list(inner.curves)
    (chain,) = chains
    ends = chain.points[[0, -1]]
    if not chain.closed and not np.all(ends[:, 1] == 0.0):
        apart = 1e3 * float(np.hypot(*(ends[1] - ends[0])))
        raise InputError(
            f"the outline is open between {place(ends[0])} and {place(ends[1])}, {apart:.4g} mm "
            f"apart; allowed: gaps up to {1e3 * near:g} mm; close it, or draw its outer and its inner line"
        )
    return _split(chain, near)


def _check_ends(inner: Chain, outer: Chain, near: float, place: Callable[[Array], str], loose: str) -> None:
    """Refuse an inner line that ends within the casing: a part of it may be missing."""
    ends = outer.points[[0, -1], 0]
    for point in inner.points[[0, -1]]:
        if point[1] != 0.0 and np.abs(ends - point[0]).min() > near:
            raise InputError(
                f"the inner line ends at {place(point)}, neither on the axis nor at an end of the casing{loose}; "
                "allowed: a closed outline, or a line drawn on to the axis where the cavity ends"
            )


def _kind(chain: Chain) -> str:
    return "a closed one" if chain.closed else "an open one"


def _loose_words(chains: Sequence[Chain], near: float, place: Callable[[Array], str]) -> str:
    """The nearest two loose ends, which may be a gap."""
    ends = np.array([chain.points[at] for chain in chains if not chain.closed for at in (0, -1)]).reshape(-1, 2)
    ends = ends[ends[:, 1] != 0.0]
    if len(ends) < 2:
        return ""
    apart = np.hypot(ends[:, None, 0] - ends[None, :, 0], ends[:, None, 1] - ends[None, :, 1])
    np.fill_diagonal(apart, np.inf)
    one, other = np.unravel_index(int(np.argmin(apart)), apart.shape)
    where, closed = place(ends[one]), f"up to {1e3 * near:g} mm are closed"
    return f"; the nearest loose ends are {1e3 * float(apart[one, other]):.4g} mm apart, at {where} ({closed})"


def _split(chain: Chain, near: float) -> tuple[list[Curve], list[Curve]]:
    """A casing's outline cut at its two ends into its outer and its inner line."""
    curves = list(chain.curves)
    if not chain.closed:  # along the axis
        ends = chain.points[[-1, 0]]
        if abs(ends[0, 0] - ends[1, 0]) > near:
            curves.append(Curve(ends))
    every = np.concatenate([curve.points for curve in curves])
    low, high = float(every[:, 0].min()), float(every[:, 0].max())
    pieces = _with_corners_at(curves, (low, high), near)
    corners = np.array([piece.points[0] for piece in pieces])
    tops, feet = [], []
    for end in (low, high):
        there = np.flatnonzero(np.abs(corners[:, 0] - end) <= near)
        tops.append(int(there[np.argmax(corners[there, 1])]))
        feet.append(int(there[np.argmin(corners[there, 1])]))
    outer, inner = _path(pieces, tops[0], tops[1], feet), _path(pieces, feet[0], feet[1], tops)
    return outer, inner


def _with_corners_at(curves: Sequence[Curve], ends: tuple[float, float], near: float) -> list[Curve]:
    """The curves of an outline, one that is smooth at an end of the casing cut there."""
    made = []
    for piece in curves:
        points, first = piece.points, 0
        for index in range(1, len(points) - 1):
            extreme = any(abs(points[index, 0] - end) <= 1e-3 * near for end in ends)
            turns = (points[index, 0] - points[index - 1, 0]) * (points[index + 1, 0] - points[index, 0]) <= 0.0
            if extreme and turns:
                made.append(Curve(points[first : index + 1], piece.layer))
                first = index
        made.append(Curve(points[first:], piece.layer))
    return made


def _path(pieces: Sequence[Curve], start: int, end: int, avoided: Sequence[int]) -> list[Curve]:
    """Curves of a closed outline from one corner to another, the way that passes none of the avoided corners within."""
    number = len(pieces)
    forward = [(start + step) % number for step in range((end - start) % number)]
    if not any(corner in avoided for corner in forward[1:]):
        return [pieces[index] for index in forward]
    backward = [(start - 1 - step) % number for step in range((start - end) % number)]
    return [Curve(pieces[index].points[::-1], pieces[index].layer) for index in backward]


def _monotone(
    name: str, curves: Sequence[Curve], tolerance: float, near: float, place: Callable[[Array], str]
) -> list[Array]:
    """Smooth pieces of a line, stations increasing: ends across the axis left out, steps as short cones."""
    parts = [one.points for one in curves]
    if parts and parts[0][0, 0] > parts[-1][-1, 0]:
        parts = [one[::-1] for one in reversed(parts)]
    parts = _trimmed(parts, near)
    if not parts:
        raise InputError(f"found no {name}: the outline encloses no hollow; allowed: a casing with a cavity")
    made: list[Array] = []
    for part in parts:
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
            kept = np.concatenate([[True], np.diff(forward) > 0.0])
            made.append(np.column_stack([forward, part[:, 1]])[kept])
    return with_cones(made, 0.5 * _STEP * tolerance)


def _trimmed(parts: list[Array], near: float) -> list[Array]:
    """Parts of a line without its ends on the axis, and without faces across the axis there."""
    kept = list(parts)
    for end in (0, -1):
        while kept and (kept[end][:, 1].max() <= near or np.ptp(kept[end][:, 0]) <= 1e-2 * near):
            kept.pop(end)
    return kept


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
    """Corners of the fewest chords that Douglas and Peucker's way finds within `tolerance` (m) of a line's points.

    `parts` (n, 2) follow each other, each beginning where the one before ends.
    """
    points = np.concatenate([parts[0][:1], *(one[1:] for one in parts)])
    kept = np.zeros(len(points), dtype=bool)
    kept[[0, -1]] = True
    waiting = [(0, len(points) - 1)]
    while waiting:
        first, last = waiting.pop()
        way, away = points[last] - points[first], points[first + 1 : last] - points[first]
        off = np.abs(way[0] * away[:, 1] - way[1] * away[:, 0]) / np.hypot(*way)
        if off.size and off.max() > tolerance:
            worst = first + 1 + int(np.argmax(off))
            kept[worst] = True
            waiting += [(first, worst), (worst, last)]
    return points[kept]


def _difference(one: Section, other: Section) -> tuple[float, float]:
    """Largest difference (m) of the radii of two halves, and its station."""
    worst = (0.0, 0.0)
    for first, second in ((one.outer, other.outer), (one.cavity, other.cavity)):
        ends = float(np.abs(first[[0, -1], 0] - second[[0, -1], 0]).max())
        worst = max(worst, (ends, float(first[0, 0])))
        at = np.linspace(max(first[0, 0], second[0, 0]), min(first[-1, 0], second[-1, 0]), _COMPARED)
        off = np.abs(np.interp(at, *first.T) - np.interp(at, *second.T))
        worst = max(worst, (float(off.max()), float(at[int(np.argmax(off))])))
    return worst
