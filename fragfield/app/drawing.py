"""Dimensioned drawing of a round as SVG, quick enough to follow what is typed; numbers as in the report."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from fragfield.numbers import number
from fragfield.report.figures.arrangement import outlines
from fragfield.report.figures.round_drawing import centre_of_mass, round_masses

if TYPE_CHECKING:
    from collections.abc import Iterator

    from numpy.typing import NDArray

    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.geometry.contour import Contour
    from burst_fenicsx.problem import Round
    from fragfield.app.fields import Texts
    from fragfield.case import CaseTable


_WIDTHS = {False: 640.0, True: 350.0}  # of the picture, in its own units; narrow: of a telephone
_HEIGHT, _SIDE, _FOOT = 182.0, 40.0, 96.0  # of the round, beside and below it
_SAMPLES = 120  # stations of a contour
_ROOM = 50.0  # that the text of a length needs


def round_facts(item: Round) -> dict[str, float]:
    """Masses (kg), C/M, fuze density (kg/m3), centre of mass, length and diameter (m) of a round with a profile."""
    masses, profile = round_masses(item), item.profile
    assert profile is not None
    return {
        **masses,
        "whole": sum(masses.values()),
        "ratio": masses["charge"] / masses["casing"],
        "fuze_density": profile.fuze_density,
        "centre": centre_of_mass(item),
        "length": profile.length,
        "diameter": 2.0 * profile.max_radius,
    }


def round_svg(item: Round, centre: float, texts: Texts, *, narrow: bool = False) -> str:
    """The section of a round along its axis, nose to the left, with lengths, diameters, walls and centre of mass.

    `item`: with a profile; `centre`: station of its centre of mass (m); `texts`: words of the drawing; `narrow`: for a
    telephone: fewer texts fit beside each other.
    """
    assert item.profile is not None
    return _Section(item.profile, texts, _WIDTHS[narrow]).svg(centre, "narrow" if narrow else "wide")


PATTERNS = (
    '<svg width="0" height="0" style="position:absolute" aria-hidden="true"><defs>'
    '<pattern id="hatch" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
    '<rect width="6" height="6" fill="#d3d8de"/><path d="M0 0V6" stroke="#5d6670"/></pattern>'
    '<pattern id="dots" width="7" height="7" patternUnits="userSpaceOnUse"><rect width="7" height="7" fill="#f6ead2"/>'
    '<circle cx="2" cy="2" r="0.9" fill="#7a4b00"/></pattern>'
    '<pattern id="cross" width="8" height="8" patternUnits="userSpaceOnUse"><rect width="8" height="8" fill="#dcebf2"/>'
    '<path d="M0 0L8 8M8 0L0 8" stroke="#3d8fa6" stroke-width="0.7"/></pattern></defs></svg>'
)
"""Fills of all drawings, once in every page."""


class _Section:
    """A round in its picture: where its stations and radii are drawn."""

    def __init__(self, profile: Profile, texts: Texts, width: float) -> None:
        self.profile, self.texts, self.width = profile, texts, width
        self.scale = min((width - 2.0 * _SIDE) / profile.length, 0.5 * _HEIGHT / profile.max_radius)
        self.left = 0.5 * (width - self.scale * profile.length)
        self.diameters = self._diameters()
        self.head = 20.0 + 16.0 * len(self.diameters)  # above the round
        self.middle = self.head + 16.0 + self.scale * profile.max_radius
        self.base = self.middle + self.scale * profile.max_radius

    def svg(self, centre: float, kind: str) -> str:
        """The whole picture."""
        title, start = escape(self.texts("round.drawing")), self.left - 12
        parts = [
            self._area(self.profile.outer, (0.0, self.profile.length), "casing"),
            *self._contents(),
            _line(start, self.middle, self.left + self.scale * self.profile.length + 12, self.middle, "axis"),
            *self._lengths(),
            *self._walls(),
            *self._centre(centre),
        ]
        size = f'viewBox="0 0 {self.width:g} {self.base + _FOOT:.0f}" role="img"'
        return f'<svg class="drawing {kind}" {size} aria-label="{title}">{"".join(parts)}</svg>'

    def _x(self, station: float) -> float:
        return self.left + self.scale * station

    def _diameters(self) -> list[str]:
        """The largest diameters and those of the ends, in lines that fit."""
        profile, texts = self.profile, self.texts
        stations = np.linspace(profile.charge_front, profile.charge_end, 401)
        charge = float(profile.cavity.radius(stations).max())
        ends = [(texts("drawing.nose"), profile.outer.radii[0]), (texts("drawing.base"), profile.outer.radii[-1])]
        named = [("", profile.outer.max_radius), (texts("drawing.charge"), charge), *ends]
        words = [f"{name} ⌀ {_mm(2.0 * radius)}".strip() for name, radius in named]
        return [", ".join(words)] if self.width > 500.0 else [", ".join(words[:2]), ", ".join(words[2:])]

    def _contents(self) -> Iterator[str]:
        """Charge, and before it fuze or void."""
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
            yield _text(middle, base + (29, 41)[line], _mm(segment.end - segment.start), "small")
            taken[line] = middle + 0.5 * _ROOM
            if line == 0 and end - start > max(_ROOM, 5.0 * len(segment.name)):
                yield _text(middle, base + 41, segment.name, "small")
                taken[1] = middle + 0.5 * max(_ROOM, 5.0 * len(segment.name))
        front, end, charge = self._x(profile.charge_front), self._x(profile.charge_end), self.texts("drawing.charge")
        yield from _dimension(front, end, base + 54, f"{charge} {_mm(profile.charge_end - profile.charge_front)}")
        if profile.fuze is not None and profile.charge_front > profile.cavity.start:
            start = self._x(profile.cavity.start)
            yield from _dimension(start, front, base + 54, _mm(profile.charge_front - profile.cavity.start))
        length = f"{self.texts('drawing.length')} {_mm(profile.length)}"
        yield from _dimension(self.left, self._x(profile.length), base + 76, length)
        for line, words in enumerate(self.diameters):
            yield _text(0.5 * self.width, 15 + 16 * line, words, "label")

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
                yield _line(x, outer, x, self.head + 4, "extension")
                yield _text(x, self.head, f"{self.texts('drawing.wall')} {_mm(float(section.wall))}", "small")
                last = x

    def _centre(self, station: float) -> Iterator[str]:
        x, y = self._x(station), self.middle
        yield f'<circle class="centre" cx="{x:.1f}" cy="{y:.1f}" r="5"/>'
        yield _line(x - 5, y, x + 5, y, "wall") + _line(x, y - 5, x, y + 5, "wall")
        side, kind = (-8, "end") if x > 0.6 * self.width else (8, "start")
        yield _text(x + side, y - 8, f"{self.texts('drawing.centre')} {_mm(station)}", f"small {kind} halo")


def _dimension(start: float, end: float, y: float, words: str) -> Iterator[str]:
    ticks = "".join(f"M{x - 3:.1f} {y + 3:.1f}L{x + 3:.1f} {y - 3:.1f}" for x in (start, end))
    yield f'<path class="dimension" d="M{start:.1f} {y:.1f}H{end:.1f}{ticks}"/>'
    if words:
        yield _text(0.5 * (start + end), y + 11, words, "small")


def _line(x: float, y: float, to_x: float, to_y: float, kind: str) -> str:
    return f'<path class="{kind}" d="M{x:.1f} {y:.1f}L{to_x:.1f} {to_y:.1f}"/>'


def _text(x: float, y: float, words: str, kind: str) -> str:
    return f'<text class="{kind}" x="{x:.1f}" y="{y:.1f}">{escape(words)}</text>'


def _mm(length: float) -> str:
    return f"{number(1e3 * length, 4)} mm"


_PLAN_WIDTH, _MOST_HEIGHT, _MARGIN = 560.0, 420.0, 0.15
_MOST_NAMED = 24


def plan_svg(case: CaseTable, vertical: int, title: str) -> str:
    """The rounds of a resolved case seen from above (`vertical` = 1) or along +y (2); images behind planes dashed.

    `case`: resolved; `vertical`: axis that points upwards in the picture; `title`: for readers that do not see it.
    """
    bodies = list(outlines(case, vertical))
    if not bodies:
        return ""
    ground = _ground(case) if vertical == 2 else None
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
    bar = round_length(0.25 * _PLAN_WIDTH / scale)
    foot = height + 16
    parts.append(f'<path class="dimension" d="M10 {foot - 4:.1f}v8M10 {foot:.1f}h{scale * bar:.1f}m0 -4v8"/>')
    parts.append(f'<text class="small start" x="{16 + scale * bar:.1f}" y="{foot + 4:.1f}">{bar:g} m</text>')
    head = f'<svg viewBox="0 0 {_PLAN_WIDTH:g} {height + 30:.0f}" role="img" aria-label="{escape(title)}">'
    return f"{head}{''.join(parts)}</svg>"


def _ground(case: CaseTable) -> float:
    from fragfield.case.conversion.surroundings import ground_height

    return ground_height(case, *np.mean([entry.position[:2] for entry in case.round], axis=0))


def round_length(length: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is no longer."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= length))
