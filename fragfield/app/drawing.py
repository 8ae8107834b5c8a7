"""Dimensioned drawing of a round as SVG, quick enough to follow what is typed; numbers as in the report."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from fragfield.numbers import number
from fragfield.report.figures.round_drawing import centre_of_mass, round_masses

if TYPE_CHECKING:
    from collections.abc import Iterator

    from burst_fenicsx.geometry import Profile
    from burst_fenicsx.geometry.contour import Contour
    from burst_fenicsx.problem import Round

__all__ = ["PATTERNS", "round_facts", "round_svg"]

_WIDTH, _HEIGHT = 640.0, 330.0  # of the picture, in its own units
_SIDE, _HEAD, _FOOT = 40.0, 52.0, 96.0  # beside, above and below the round
_SAMPLES = 120  # stations of a contour
_ROOM = 46.0  # that the text of a length needs


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


def round_svg(item: Round, title: str) -> str:
    """The section of a round along its axis, nose to the left, with lengths, diameters, walls and centre of mass.

    Parameters
    ----------
    item : Round
        With a profile.
    title : str
        For readers that do not see it.
    """
    profile = item.profile
    assert profile is not None
    scale = min((_WIDTH - 2.0 * _SIDE) / profile.length, (_HEIGHT - _HEAD - _FOOT) / (2.0 * profile.max_radius))
    left, middle = 0.5 * (_WIDTH - scale * profile.length), _HEAD + scale * profile.max_radius
    parts = [
        _area(profile.outer, (0.0, profile.length), left, middle, scale, "casing"),
        *_contents(profile, left, middle, scale),
        _line(left - 12, middle, left + scale * profile.length + 12, middle, "axis"),
        *_lengths(profile, left, middle, scale),
        *_walls(profile, left, middle, scale),
        *_centre(centre_of_mass(item), left, middle, scale),
    ]
    height = middle + scale * profile.max_radius + _FOOT
    return (
        f'<svg class="drawing" viewBox="0 0 {_WIDTH:g} {height:.0f}" role="img" aria-label="{escape(title)}">'
        f"{PATTERNS}{''.join(parts)}</svg>"
    )


PATTERNS = (
    '<defs><pattern id="hatch" width="6" height="6" patternUnits="userSpaceOnUse" patternTransform="rotate(45)">'
    '<rect width="6" height="6" fill="#d3d8de"/><path d="M0 0V6" stroke="#5d6670"/></pattern>'
    '<pattern id="dots" width="7" height="7" patternUnits="userSpaceOnUse"><rect width="7" height="7" fill="#f6ead2"/>'
    '<circle cx="2" cy="2" r="0.9" fill="#7a4b00"/></pattern>'
    '<pattern id="cross" width="8" height="8" patternUnits="userSpaceOnUse"><rect width="8" height="8" fill="#dcebf2"/>'
    '<path d="M0 0L8 8M8 0L0 8" stroke="#3d8fa6" stroke-width="0.7"/></pattern></defs>'
)


def _contents(profile: Profile, left: float, middle: float, scale: float) -> Iterator[str]:
    """Charge, and before it fuze or void."""
    if profile.fuze is not None:
        kind = "fuze" if profile.fuze.fill == "inert" else "void"
        yield _area(profile.cavity, (profile.cavity.start, profile.charge_front), left, middle, scale, kind)
    yield _area(profile.cavity, (profile.charge_front, profile.charge_end), left, middle, scale, "charge")


def _area(contour: Contour, between: tuple[float, float], left: float, middle: float, scale: float, kind: str) -> str:
    corners = [station for station in contour.stations if between[0] < station < between[1]]
    stations = np.unique([*np.linspace(*between, _SAMPLES), *corners])
    across, along = scale * contour.radius(stations), left + scale * stations
    upper = [f"{x:.1f},{middle - y:.1f}" for x, y in zip(along, across, strict=True)]
    lower = [f"{x:.1f},{middle + y:.1f}" for x, y in zip(along[::-1], across[::-1], strict=True)]
    return f'<polygon class="{kind}" points="{" ".join([*upper, *lower])}"/>'


def _lengths(profile: Profile, left: float, middle: float, scale: float) -> Iterator[str]:
    """Below the round: its segments, charge and fuze, and the whole length; above it the largest diameters."""
    base = middle + scale * profile.max_radius
    taken = 0.0  # up to which the first line of texts is full: the next goes below
    for segment in profile.segments:
        start, end = left + scale * segment.start, left + scale * segment.end
        yield _line(end, middle, end, base + 18, "extension")
        yield from _dimension(start, end, base + 18, "")
        free = 0.5 * (start + end) - 0.5 * _ROOM > taken
        yield _text(0.5 * (start + end), base + (29 if free else 41), _mm(segment.end - segment.start), "small")
        if end - start > max(_ROOM, 5.0 * len(segment.name)):
            yield _text(0.5 * (start + end), base + 41, segment.name, "small")
        taken = 0.5 * (start + end) + 0.5 * _ROOM if free else 0.0
    front, end = left + scale * profile.charge_front, left + scale * profile.charge_end
    yield from _dimension(front, end, base + 54, f"charge {_mm(profile.charge_end - profile.charge_front)}")
    if profile.fuze is not None and profile.charge_front > profile.cavity.start:
        start = left + scale * profile.cavity.start
        yield from _dimension(start, front, base + 54, _mm(profile.charge_front - profile.cavity.start))
    yield from _dimension(left, left + scale * profile.length, base + 76, f"length {_mm(profile.length)}")
    widest = profile.outer.max_radius
    stations = np.linspace(profile.charge_front, profile.charge_end, 401)
    yield _text(
        0.5 * _WIDTH, 15, f"⌀ {_mm(2.0 * widest)}, charge ⌀ {_mm(2.0 * float(profile.cavity.radius(stations).max()))}, "
        f"nose ⌀ {_mm(2.0 * profile.outer.radii[0])}, base ⌀ {_mm(2.0 * profile.outer.radii[-1])}", "label",
    )  # fmt: skip


def _walls(profile: Profile, left: float, middle: float, scale: float) -> Iterator[str]:
    """Above the round: the thickness of the wall in the middle of each segment of the wall."""
    low, high, last = profile.cavity.start, profile.cavity.end, -_ROOM
    for segment in profile.segments:
        station = 0.5 * (segment.start + segment.end)
        if segment.kind != "wall" or not low < station < high:
            continue
        section, x = profile.section(station), left + scale * station
        outer, inner = (middle - scale * float(radius) for radius in (section.outer_radius, section.inner_radius))
        yield _line(x, inner, x, outer, "wall")
        if x - last > 1.5 * _ROOM:
            yield _line(x, outer, x, 40, "extension")
            yield _text(x, 36, f"wall {_mm(float(section.wall))}", "small")
            last = x


def _centre(station: float, left: float, middle: float, scale: float) -> Iterator[str]:
    x = left + scale * station
    yield f'<circle class="centre" cx="{x:.1f}" cy="{middle:.1f}" r="5"/>'
    yield _line(x - 5, middle, x + 5, middle, "wall") + _line(x, middle - 5, x, middle + 5, "wall")
    yield _text(x + 8, middle - 8, f"centre of mass {_mm(station)}", "small start halo")


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
