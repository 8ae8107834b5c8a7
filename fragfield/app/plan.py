"""Plan and elevation of the rounds as SVG, from the surfaces that the report's figure draws."""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING

import numpy as np

from fragfield.report.figures.arrangement import outlines

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from fragfield.case import CaseTable

__all__ = ["plan_svg", "round_length"]

_WIDTH, _MOST_HEIGHT, _ROOM = 560.0, 420.0, 0.15
_MOST_NAMED = 24


def plan_svg(case: CaseTable, vertical: int, title: str) -> str:
    """The rounds of a resolved case seen from above (`vertical` = 1) or along +y (2); images behind planes dashed.

    Parameters
    ----------
    case : CaseTable
        Resolved.
    vertical : int
        Axis that points upwards in the picture.
    title : str
        For readers that do not see it.
    """
    bodies = list(outlines(case, vertical))
    if not bodies:
        return ""
    ground = _ground(case) if vertical == 2 else None
    points = np.concatenate([outline for _, outline, _ in bodies])
    low, high = points.min(axis=0), points.max(axis=0)
    if ground is not None:
        low[1] = min(low[1], ground)
    room = _ROOM * float((high - low).max())
    low, high = low - room, high + room
    scale = min(_WIDTH / (high - low)[0], _MOST_HEIGHT / (high - low)[1])
    height = scale * float((high - low)[1])
    left = 0.5 * (_WIDTH - scale * float((high - low)[0]))

    def at(place: NDArray[np.float64]) -> tuple[float, float]:
        x, y = scale * (place - low)
        return left + float(x), height - float(y)

    parts = []
    if ground is not None:
        y = at(np.array([low[0], ground]))[1]
        words = escape(f"z = {ground:g} m")
        parts.append(f'<path class="ground" d="M0 {y:.1f}H{_WIDTH:g}"/>')
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
    bar = round_length(0.25 * _WIDTH / scale)
    foot = height + 16
    parts.append(f'<path class="dimension" d="M10 {foot - 4:.1f}v8M10 {foot:.1f}h{scale * bar:.1f}m0 -4v8"/>')
    parts.append(f'<text class="small start" x="{16 + scale * bar:.1f}" y="{foot + 4:.1f}">{bar:g} m</text>')
    head = f'<svg viewBox="0 0 {_WIDTH:g} {height + 30:.0f}" role="img" aria-label="{escape(title)}">'
    return f"{head}{''.join(parts)}</svg>"


def _ground(case: CaseTable) -> float:
    from fragfield.case.conversion.surroundings import ground_height

    return ground_height(case, *np.mean([entry.position[:2] for entry in case.round], axis=0))


def round_length(length: float) -> float:
    """The largest of 1, 2 and 5 times a power of ten that is no longer."""
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(factor * power for factor in (1.0, 2.0, 5.0) if factor * power <= length))
