"""Rounds as SVG, quick enough to follow what is typed: dimensioned drawings, plan and elevation of where they stand."""

from __future__ import annotations

from functools import partial
from html import escape
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.rounds import burst_rounds, first_alike, masses_of
from fragfield.errors import InputError
from fragfield.numbers import number
from fragfield.report.figures.drawing import figure, round_length
from fragfield_base.substances import substance_title

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.geometry.contour import Contour
    from burst_fenicsx.problem import Round
    from fragfield.case import CaseTable
    from fragfield.results.run import StoredRun


DRAWINGS = ("drawing_1", "drawing_2", "drawing_3", "plan", "elevation")
"""Names of the figures drawn here; a report draws no more different rounds than these."""

_WIDTH = 470.0  # of the picture, in its own units: a column of a page, or a telephone
_HEIGHT, _SIDE, _HEAD, _FOOT = 182.0, 40.0, 52.0, 96.0  # of the round, beside, above and below it
_SAMPLES = 120  # stations of a contour
_ROOM = 50.0  # that the text of a length needs
_STATIONS, _AROUND = 41, 36  # of a round's surface
_PLAN_WIDTH, _MOST_HEIGHT, _MARGIN = 560.0, 420.0, 0.15
_MOST_NAMED = 24


def round_svg(item: Round, centre: float, notes: Sequence[str] = ()) -> str:
    """The section of a round along its axis, nose to the left, with lengths, diameters, walls and centre of mass.

    `item`: with a profile; `centre`: station of its centre of mass (m); `notes`: lines below it.
    """
    assert item.profile is not None
    return _Section(item.profile).svg(centre, notes)


_FILLS = (
    "<defs>"
    '<pattern id="hatch" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
    '<rect width="6" height="6" fill="#d3d8de"/><path d="M0 0V6" stroke="#5d6670"/></pattern>'
    '<pattern id="dots" width="7" height="7" patternUnits="userSpaceOnUse"><rect width="7" height="7" fill="#f6ead2"/>'
    '<circle cx="2" cy="2" r="0.9" fill="#7a4b00"/></pattern>'
    '<pattern id="cross" width="8" height="8" patternUnits="userSpaceOnUse"><rect width="8" height="8" fill="#dcebf2"/>'
    '<path d="M0 0L8 8M8 0L0 8" stroke="#3d8fa6" stroke-width="0.7"/></pattern></defs>'
)
_STYLE = """
svg .casing { fill: url(#hatch); stroke: #1d2733; stroke-width: 1.1; }
svg .charge { fill: url(#dots); stroke: #1d2733; stroke-width: .8; }
svg .fuze { fill: url(#cross); stroke: #1d2733; stroke-width: .8; }
svg .void { fill: #fff; stroke: #1d2733; stroke-width: .8; }
svg .axis { stroke: #1d2733; stroke-width: .7; stroke-dasharray: 10 3 2 3; fill: none; }
svg .extension { stroke: #8b95a1; stroke-width: .5; fill: none; }
svg .dimension, svg .wall { stroke: #1d2733; stroke-width: 1; fill: none; }
svg .wall { stroke-width: 1.4; }
svg .centre { fill: #fff; stroke: #1d2733; }
svg text { font-size: 11px; fill: #1d2733; text-anchor: middle; font-family: inherit; }
svg text.small { font-size: 10px; }
svg text.label { font-size: 12px; }
svg text.start { text-anchor: start; }
svg text.end { text-anchor: end; }
svg text.halo { paint-order: stroke; stroke: #fff; stroke-width: 3px; }
svg .body { fill: url(#hatch); stroke: #1d2733; }
svg .image { fill: #f2f4f6; stroke: #5d6670; stroke-dasharray: 5 3; }
svg .initiated { fill: #c4601d; stroke: #fff; }
svg .ground { stroke: #6b4e16; stroke-width: 2; fill: none; }
svg .plane { stroke: #c4601d; stroke-width: 1; stroke-dasharray: 8 3 2 3; fill: none; }
"""

PATTERNS = (
    f'<svg width="0" height="0" style="position:absolute" aria-hidden="true"><style>{_STYLE}</style>{_FILLS}</svg>'
)
"""Fills of all drawings, once in every page."""


class _Section:
    def __init__(self, profile: Profile) -> None:
        self.profile = profile
        self.scale = min((_WIDTH - 2.0 * _SIDE) / profile.length, 0.5 * _HEIGHT / profile.max_radius)
        self.left = 0.5 * (_WIDTH - self.scale * profile.length)
        self.middle = _HEAD + 16.0 + self.scale * profile.max_radius
        self.base = self.middle + self.scale * profile.max_radius

    def svg(self, centre: float, notes: Sequence[str]) -> str:
        start, foot = self.left - 12, self.base + _FOOT + 10.0
        parts = [
            self._area(self.profile.outer, (0.0, self.profile.length), "casing"),
            *self._contents(),
            _line(start, self.middle, self.left + self.scale * self.profile.length + 12, self.middle, "axis"),
            *self._lengths(),
            *self._walls(),
            *self._centre(centre),
            *(svg_text(0.5 * _WIDTH, foot + 14 * line, words, "small") for line, words in enumerate(notes)),
        ]
        height = foot + 14 * len(notes) if notes else self.base + _FOOT
        size = f'viewBox="0 0 {_WIDTH:g} {height:.0f}" role="img"'
        return f'<svg class="drawing" {size} aria-label="Dimensioned section of the round">{"".join(parts)}</svg>'

    def _x(self, station: float) -> float:
        return self.left + self.scale * station

    def _diameters(self) -> list[str]:
        profile = self.profile
        stations = np.linspace(profile.charge_front, profile.charge_end, 401)
        charge = float(profile.cavity.radius(stations).max())
        ends = [("nose", profile.outer.radii[0]), ("base", profile.outer.radii[-1])]
        named = [("", profile.outer.max_radius), ("charge", charge), *ends]
        words = [f"{name} ⌀ {_mm(2.0 * radius)}".strip() for name, radius in named]
        return [", ".join(words[:2]), ", ".join(words[2:])]

    def _contents(self) -> Iterator[str]:
        profile = self.profile
        if profile.fuze is not None:
            kind = "fuze" if profile.fuze.fill == "inert" else "void"
            yield self._area(profile.cavity, (profile.cavity.start, profile.charge_front), kind)
        yield self._area(profile.cavity, (profile.charge_front, profile.charge_end), "charge")

    def _area(self, contour: Contour, between: tuple[float, float], kind: str) -> str:
        corners = [station for station in contour.stations if between[0] < station < between[1]]
        stations = np.unique([*np.linspace(*between, _SAMPLES), *corners])
        across, along = self.scale * contour.radius(stations), self.left + self.scale * stations
        upper = [f"{x:.1f},{self.middle - y:.1f}" for x, y in zip(along, across, strict=True)]
        lower = [f"{x:.1f},{self.middle + y:.1f}" for x, y in zip(along[::-1], across[::-1], strict=True)]
        return f'<polygon class="{kind}" points="{" ".join([*upper, *lower])}"/>'

    def _lengths(self) -> Iterator[str]:
        """Below the round: its segments, charge and fuze, and the whole length; above it the largest diameters."""
        profile, base = self.profile, self.base
        taken = [0.0, 0.0]  # up to which both lines of texts are full
        for segment in profile.segments:
            start, end = self._x(segment.start), self._x(segment.end)
            middle = 0.5 * (start + end)
            yield _line(end, self.middle, end, base + 18, "extension")
            yield from _dimension(start, end, base + 18, "")
            line = next((one for one in (0, 1) if middle - 0.5 * _ROOM > taken[one]), None)
            if line is None:  # no room for its length
                continue
            yield svg_text(middle, base + (29, 41)[line], _mm(segment.end - segment.start), "small")
            taken[line] = middle + 0.5 * _ROOM
            if line == 0 and end - start > max(_ROOM, 5.0 * len(segment.name)):
                yield svg_text(middle, base + 41, segment.name, "small")
                taken[1] = middle + 0.5 * max(_ROOM, 5.0 * len(segment.name))
        front, end = self._x(profile.charge_front), self._x(profile.charge_end)
        yield from _dimension(front, end, base + 54, f"charge {_mm(profile.charge_end - profile.charge_front)}")
        if profile.fuze is not None and profile.charge_front > profile.cavity.start:
            start = self._x(profile.cavity.start)
            yield from _dimension(start, front, base + 54, _mm(profile.charge_front - profile.cavity.start))
        length = f"length {_mm(profile.length)}"
        yield from _dimension(self.left, self._x(profile.length), base + 76, length)
        for line, words in enumerate(self._diameters()):
            yield svg_text(0.5 * _WIDTH, 15 + 16 * line, words, "label")

    def _walls(self) -> Iterator[str]:
        """Above the round: the thickness of the wall in the middle of each segment of the wall."""
        low, high, last = self.profile.cavity.start, self.profile.cavity.end, -_ROOM
        for segment in self.profile.segments:
            station = 0.5 * (segment.start + segment.end)
            if segment.kind != "wall" or not low < station < high:
                continue
            section, x = self.profile.section(station), self._x(station)
            radii = (section.outer_radius, section.inner_radius)
            outer, inner = (self.middle - self.scale * float(radius) for radius in radii)
            yield _line(x, inner, x, outer, "wall")
            if x - last > 1.7 * _ROOM:
                yield _line(x, outer, x, _HEAD + 4, "extension")
                yield svg_text(x, _HEAD, f"wall {_mm(float(section.wall))}", "small")
                last = x

    def _centre(self, station: float) -> Iterator[str]:
        x, y = self._x(station), self.middle
        yield f'<circle class="centre" cx="{x:.1f}" cy="{y:.1f}" r="5"/>'
        yield _line(x - 5, y, x + 5, y, "wall") + _line(x, y - 5, x, y + 5, "wall")
        side, kind = (-8, "end") if x > 0.6 * _WIDTH else (8, "start")
        yield svg_text(x + side, y - 8, f"centre of mass {_mm(station)}", f"small {kind} halo")


def _dimension(start: float, end: float, y: float, words: str) -> Iterator[str]:
    ticks = "".join(f"M{x - 3:.1f} {y + 3:.1f}L{x + 3:.1f} {y - 3:.1f}" for x in (start, end))
    yield f'<path class="dimension" d="M{start:.1f} {y:.1f}H{end:.1f}{ticks}"/>'
    if words:
        yield svg_text(0.5 * (start + end), y + 11, words, "small")


def _line(x: float, y: float, to_x: float, to_y: float, kind: str) -> str:
    return f'<path class="{kind}" d="M{x:.1f} {y:.1f}L{to_x:.1f} {to_y:.1f}"/>'


def svg_text(x: float, y: float, words: str, kind: str) -> str:
    """Words of a kind (CSS classes) at a place of a drawing."""
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}">{escape(words)}</text>'


def _mm(length: float) -> str:
    return f"{number(1e3 * length, 4)} mm"


def drawn_rounds(case: CaseTable) -> list[Round]:
    """The rounds of a resolved case that differ in more than place and ignition."""
    rounds = burst_rounds(case) if case.round else []
    return [rounds[index] for index in dict.fromkeys(first_alike(case))] if rounds else []


def expected_masses(case: CaseTable) -> list[dict[str, float]]:
    """Masses (kg) of casing and charge that the drawings of `drawn_rounds` give, as far as the case has them."""
    tables = [case.round[index].expected for index in dict.fromkeys(first_alike(case))] if case.round else []
    return [{} if table is None else {key: mass for key, mass in table if mass is not None} for table in tables]


def centre_of_mass(item: Round) -> float:
    """Station (m from the nose) of the centre of mass of a round with a profile, its fuze evenly in its cavity."""
    profile = item.profile
    assert profile is not None
    corners = [*profile.outer.stations, *profile.cavity.stations, profile.charge_front]
    edges = np.unique([*np.linspace(0.0, profile.length, 201), *corners])
    # Gauss points of each interval: areas are polynomials, or nearly so, between corners.
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(edges)[:, None]
    stations = 0.5 * (edges[1:] + edges[:-1])[:, None] + half * nodes
    section = profile.section(stations)
    charge, inner = section.charge_radius**2, section.inner_radius**2
    casing = item.casing.density * (section.outer_radius**2 - inner)
    line_mass = half * weights * (casing + item.explosive.density * charge + profile.fuze_density * (inner - charge))
    return float((line_mass * stations).sum() / line_mass.sum())


def draw_round(item: Round, expected: Mapping[str, float] | None = None) -> str:
    """The drawing of a round as a file of its own, with the masses (kg) that its own drawing gives as `expected`.

    Raises InputError: the round is a mesh of hexahedra, which has no contour.
    """
    if item.profile is None:
        raise InputError(f'round "{item.name}": found mesh = "{item.mesh_file}"; allowed for a drawing: a profile')
    mass = masses_of(item)
    fuze = f", fuze {number(mass.fuze, 3)} kg" if mass.fuze else ""
    whole, ratio = number(mass.whole, 4), number(mass.ratio, 3)
    known = [
        f"{key} {number(value, 4)} kg ({round(100.0 * (getattr(mass, key) / value - 1.0), 2) + 0.0:+.2f} %)"
        for key, value in (expected or {}).items()
    ]
    notes = (
        f"casing {number(mass.casing, 4)} kg ({item.casing.name}), charge {number(mass.charge, 4)} kg",
        f"({substance_title(item.explosive.name)}){fuze}; whole {whole} kg, charge / casing {ratio}",
        *([f"By its drawing: {', '.join(known)}"] if known else []),
        "Stations and lengths from the nose.",
    )
    return svg_file(round_svg(item, centre_of_mass(item), notes))


def svg_file(svg: str) -> str:
    """A drawing as a file of its own, with its styles and fills; empty for none."""
    head, _, rest = svg.partition(">")
    return (
        f'{head} xmlns="http://www.w3.org/2000/svg" font-family="DejaVu Sans, sans-serif">'
        f"<style>{_STYLE}</style>{_FILLS}{rest}"
        if svg
        else ""
    )


def _drawing(run: StoredRun, at: int) -> str | None:
    """The drawing of a run's different round of that number; None where there is none, or it has no contour."""
    rounds = drawn_rounds(run.values) if run.values is not None and run.fragments_file is None else []
    if run.values is None or at >= len(rounds) or rounds[at].profile is None:
        return None
    return draw_round(rounds[at], expected_masses(run.values)[at])


def _name_of(run: StoredRun, at: int) -> str:
    return "" if run.values is None else f"Drawing of {drawn_rounds(run.values)[at].name}"


for _at, _name in enumerate(DRAWINGS[:3]):
    figure(
        _name, partial(_name_of, at=_at),
        "Section along the axis: casing (lines), charge (dots), fuze (crosses), with the segments of the break-up. "
        "Cross in a circle: centre of mass.",
    )(partial(_drawing, at=_at))  # fmt: skip


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
