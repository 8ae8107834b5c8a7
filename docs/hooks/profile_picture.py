"""Makes docs/pictures/profile.png, how a profile is defined: `python docs/hooks/profile_picture.py`.

The round is that of the guide's page "Rounds": its points, arcs, charge and segments as the program reads them.
"""

from __future__ import annotations

import re
import tomllib
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.geometry import profile_from_table
from fragfield.report.figures.drawing import ACCENT, GREY, INK, WIDE, blank_figure, drawing_style

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from burst_fenicsx.geometry import Profile

__all__ = ["main"]

ROOT = Path(__file__).resolve().parents[2]
PAGE = ROOT / "docs" / "guide" / "rounds.md"
PICTURE = ROOT / "docs" / "pictures" / "profile.png"


def main() -> Path:
    """The picture of the profile in the first case file of the page."""
    text = re.search(r"```toml\n(.*?)```", PAGE.read_text(encoding="utf-8"), re.DOTALL)
    assert text is not None
    table = tomllib.loads(text[1])["round"][0]["profile"]
    profile = profile_from_table(table, where=PAGE.name)
    with drawing_style():
        figure = blank_figure(WIDE, 2.2)
        axes = figure.add_axes((0.02, 0.02, 0.96, 0.96))
        length = 1e3 * profile.length
        axes.set(xlim=(-0.09 * length, 1.1 * length), ylim=(-34.0, 76.0), aspect="equal")
        axes.set_axis_off()
        _parts(axes, profile)
        _points(axes, table["outer"], "outer", (0, 8))
        _points(axes, table["cavity"], "cavity", (0, -11))
        _axis(axes, profile)
        figure.savefig(PICTURE, dpi=160)
    return PICTURE


def _parts(axes: Axes, profile: Profile) -> None:
    for contour, start, style in (
        (profile.outer, 0.0, {"facecolor": "#d3d8de", "hatch": "////"}),
        (profile.cavity, profile.charge_front, {"facecolor": "#f3f5f8", "hatch": "...."}),
    ):
        at = np.unique([*np.linspace(start, contour.end, 300), *(s for s in contour.stations if s >= start)])
        radius = 1e3 * contour.radius(at)
        axes.fill_between(1e3 * at, 0.0, radius, edgecolor=INK, linewidth=0.8, **style)
    middle = 0.5e3 * (profile.charge_front + profile.charge_end)
    box = {"facecolor": "white", "edgecolor": "none", "pad": 1.5}
    axes.text(middle, 18.0, "charge", ha="center", va="center", bbox=box)
    axes.text(1e3 * profile.length * 0.5, 44.0, "casing", ha="center", va="center", bbox=box, fontsize=7)
    front = 1e3 * profile.charge_front
    axes.annotate(
        f"charge.front = {front:g}", (front, 4.0), (front + 40.0, -12.0), ha="center", fontsize=7,
        arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 0.7},
    )  # fmt: skip


def _points(axes: Axes, contour: dict, name: str, shift: tuple[float, float]) -> None:
    """Points with their values, and beside every arc its signed radius."""
    points = np.array(contour["points"], dtype=float)
    axes.plot(*points.T, "o", color=ACCENT, markersize=4, zorder=5)
    for number, (station, radius) in enumerate(points):
        words = f"[{station:g}, {radius:g}]" if number else f"{name}: [{station:g}, {radius:g}]"
        box = {"facecolor": "white", "edgecolor": "none", "pad": 0.8}
        style = {"textcoords": "offset points", "ha": "center", "fontsize": 7, "color": ACCENT, "bbox": box}
        axes.annotate(words, (station, radius), shift, **style)
    for index, arc in enumerate(contour.get("arcs", [])):
        if arc:
            middle = 0.5 * (points[index] + points[index + 1])
            axes.annotate(f"arc {arc:+g}, bulging outwards" if arc > 0 else f"arc {arc:g}, bulging inwards",
                          middle, (-30, 26), textcoords="offset points", ha="center", fontsize=7,
                          arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 0.7})  # fmt: skip


def _axis(axes: Axes, profile: Profile) -> None:
    """The axis, stations along it from the nose, a radius across it, and the segments."""
    length = 1e3 * profile.length
    axes.plot([-0.05 * length, 1.05 * length], [0.0, 0.0], color=INK, linewidth=0.8, linestyle="-.")
    axes.annotate("station", (0.75 * length, -7.0), (0.4 * length, -7.0), va="center", fontsize=7,
                  arrowprops={"arrowstyle": "-|>", "color": INK, "linewidth": 0.8})  # fmt: skip
    axes.text(-0.015 * length, 2.0, "nose\nend: 0", ha="right", va="bottom", fontsize=7)
    axes.text(1.012 * length, 2.0, f"base\nend: {length:g}", ha="left", va="bottom", fontsize=7)
    at = 0.66 * length
    axes.annotate("", (at, 50.0), (at, 0.0), arrowprops={"arrowstyle": "-|>", "color": ACCENT}, zorder=6)
    axes.text(at + 4.0, 25.0, "radius", color=ACCENT, fontsize=7, va="center",
              bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8})  # fmt: skip
    for segment in profile.segments:
        start, end = 1e3 * segment.start, 1e3 * segment.end
        style = {"arrowstyle": "|-|", "color": GREY, "linewidth": 0.7, "mutation_scale": 2, "shrinkA": 0, "shrinkB": 0}
        axes.annotate("", (start, -22.0), (end, -22.0), arrowprops=style)
        axes.text(0.5 * (start + end), -29.0, segment.name, ha="center", va="center", fontsize=6.5, color=INK)


if __name__ == "__main__":
    print("picture:", main())
