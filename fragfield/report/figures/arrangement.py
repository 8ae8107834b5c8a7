"""Plan and elevation of the rounds as they stand, as SVG: images behind planes of symmetry and the ground with them."""

from __future__ import annotations

from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.report.figures.drawing import figure, round_length
from fragfield.report.figures.rounds import svg_file, svg_text

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from fragfield.case import CaseTable
    from fragfield.results.run import StoredRun


_STATIONS, _AROUND = 41, 36  # of a round's surface
_PLAN_WIDTH, _MOST_HEIGHT, _MARGIN = 560.0, 420.0, 0.15
_MOST_NAMED = 24


def plan_svg(case: CaseTable, vertical: int, title: str) -> str:
    """The rounds of a resolved case seen from above (`vertical` = 1) or along +y (2); images behind planes dashed.

    `case`: resolved; `vertical`: axis that points upwards in the picture; `title`: for readers that do not see it.
    """
    bodies = list(outlines(case, vertical))
    if not bodies:
        return ""
    from fragfield.case.conversion.surroundings import ground_height

    centre = np.mean([entry.position[:2] for entry in case.round], axis=0)
    ground = ground_height(case, *centre) if vertical == 2 else None
    points = np.concatenate([outline for _, outline, _ in bodies])
    low, high = points.min(axis=0), points.max(axis=0)
    if ground is not None:
        low[1] = min(low[1], ground)
    room = _MARGIN * float((high - low).max())
    low, high = low - room, high + room
    scale = min(_PLAN_WIDTH / (high - low)[0], _MOST_HEIGHT / (high - low)[1])
    height = scale * float((high - low)[1])
    left = 0.5 * (_PLAN_WIDTH - scale * float((high - low)[0]))

    def at(place: NDArray[np.float64]) -> tuple[float, float]:
        x, y = scale * (place - low)
        return left + float(x), height - float(y)

    parts = []
    if ground is not None:
        y = at(np.array([low[0], ground]))[1]
        words = escape(f"z = {ground:g} m")
        parts.append(f'<path class="ground" d="M0 {y:.1f}H{_PLAN_WIDTH:g}"/>')
        parts.append(f'<text class="small start" x="4" y="{y + 12:.1f}">{words}</text>')
    initiated = {entry.name for entry in case.round if entry.ignition}
    for name, outline, image in bodies:
        corners = " ".join(f"{x:.1f},{y:.1f}" for x, y in map(at, outline))
        parts.append(f'<polygon class="{"image" if image else "body"}" points="{corners}"/>')
        x, y = at(outline.mean(axis=0))
        if not image and name in initiated:
            parts.append(f'<circle class="initiated" cx="{x:.1f}" cy="{y:.1f}" r="4"/>')
        if not image and len(case.round) <= _MOST_NAMED:
            parts.append(f'<text class="small halo" x="{x:.1f}" y="{y - 8:.1f}">{escape(name)}</text>')
    parts += _planes(case, vertical, low, at, height)
    bar = round_length(0.25 * _PLAN_WIDTH / scale)
    foot = height + 16
    parts.append(f'<path class="dimension" d="M10 {foot - 4:.1f}v8M10 {foot:.1f}h{scale * bar:.1f}m0 -4v8"/>')
    parts.append(f'<text class="small start" x="{16 + scale * bar:.1f}" y="{foot + 4:.1f}">{bar:g} m</text>')
    head = f'<svg viewBox="0 0 {_PLAN_WIDTH:g} {height + 30:.0f}" role="img" aria-label="{escape(title)}">'
    return f"{head}{''.join(parts)}</svg>"


def _planes(case: CaseTable, vertical: int, low: NDArray[np.float64], at: Any, height: float) -> Iterator[str]:  # noqa: ANN401
    """Planes that are level or upright, as lines where they are seen on edge."""
    for number_of, plane in enumerate(case.plane):
        normal, point = (np.array(one, dtype=float) for one in (plane.normal, plane.point))
        along = int(np.argmax(np.abs(normal)))
        if abs(normal[along]) < (1.0 - 1e-9) * np.linalg.norm(normal) or along not in (0, vertical):
            continue
        x, y = at(np.array([point[0], low[1]])) if along == 0 else at(np.array([low[0], point[along]]))
        words = f"{plane.kind} plane {plane.name}"
        if along == 0:
            yield f'<path class="plane" d="M{x:.1f} 0V{height:.1f}"/>' + svg_text(
                x + 4, 12 + 12 * number_of, words, "small start halo"
            )
        else:
            yield f'<path class="plane" d="M0 {y:.1f}H{_PLAN_WIDTH:g}"/>' + svg_text(
                _PLAN_WIDTH - 4, y - 4, words, "small end halo"
            )


def outlines(case: CaseTable, vertical: int) -> Iterator[tuple[str, NDArray[np.float64], bool]]:
    """Name, outline (n, 2) in m and whether it is an image, of every round seen along an axis.

    `vertical` is the axis that points upwards there: 1 from above, 2 along +y.
    """
    for name, surface, image in _bodies(case):
        yield name, _hull(surface[:, [0, vertical]]), image


def _bodies(case: CaseTable) -> Iterator[tuple[str, NDArray[np.float64], bool]]:
    """Name, points of the surface (n, 3) in m and whether it is an image, of every round with a contour."""
    from fragfield.case.conversion.rounds import burst_rounds

    surfaces = [
        (item.name, _surface(item.profile, np.array(item.position), np.array(item.axis)), False)
        for item in burst_rounds(case)
        if item.profile is not None
    ]
    for plane in case.plane:
        if plane.kind == "symmetry":
            normal, point = np.array(plane.normal, dtype=float), np.array(plane.point, dtype=float)
            normal /= np.linalg.norm(normal)
            surfaces += [
                (name, surface - 2.0 * ((surface - point) @ normal)[:, None] * normal, True)
                for name, surface, _ in surfaces
            ]
    yield from surfaces


def _surface(profile: Profile, base: NDArray[np.float64], axis: NDArray[np.float64]) -> NDArray[np.float64]:
    axis = axis / np.linalg.norm(axis)
    first = np.cross(axis, np.eye(3)[int(np.argmin(np.abs(axis)))])
    first /= np.linalg.norm(first)
    second = np.cross(axis, first)
    station = np.linspace(0.0, profile.length, _STATIONS)
    turn = np.linspace(0.0, 2.0 * np.pi, _AROUND, endpoint=False)
    radius = profile.section(station).outer_radius[:, None, None]
    circle = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * second
    points = base + (profile.length - station)[:, None, None] * axis + radius * circle
    return np.asarray(points.reshape(-1, 3))


def _hull(points: NDArray[np.float64]) -> NDArray[np.float64]:
    from scipy.spatial import ConvexHull

    return np.asarray(points[ConvexHull(points).vertices])


def _plan(run: StoredRun, vertical: int, title: str) -> str | None:
    if run.values is None or run.fragments_file is not None or not run.values.round:
        return None
    return svg_file(plan_svg(run.values, vertical, title)) or None


for _name, _title, _vertical in (("plan", "Plan, from above", 1), ("elevation", "Elevation, seen along +y", 2)):
    figure(
        _name, _title, "Outlines of the rounds where they stand; dashed: images behind planes of symmetry, which burst "
        "as well.",
    )(partial(_plan, vertical=_vertical, title=_title))  # fmt: skip
