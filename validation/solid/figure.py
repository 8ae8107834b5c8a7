"""The solid's checks: the bar's stress, the elastic tube's hoop stress, the rod's outline, the softening cell."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.report.figures.drawing import GREY, INK, LINES
from validation.figures import picture
from validation.solid.check import REFERENCE, lame_hoop

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from matplotlib.axes import Axes

    from validation.solid.bar import Bar
    from validation.solid.elastic_tube import ElasticTube
    from validation.solid.impact import Impact
    from validation.solid.softening import Softening

__all__ = ["draw"]

_EXACT: dict[str, Any] = {"color": GREY, "linewidth": 2.6, "linestyle": "-"}


def draw(
    bar: Bar,
    tube: ElasticTube,
    rod: Impact,
    expected_length: float,
    cells: Mapping[str, Softening],
    path: Path,
) -> Path:
    """Write the figure as PNG; closed forms are the wide grey lines."""
    with picture(path, 2, rows=2, height=5.6) as (waves, hoop, outline, softening):
        _draw_bar(waves, bar)
        values = REFERENCE["tube"]
        radii = np.linspace(values["inner_radius"], values["outer_radius"], 80)
        hoop.plot(radii, [lame_hoop(values, float(one)) / 1e3 for one in radii], label="Lamé", **_EXACT)
        hoop.plot(tube.radius, tube.hoop / 1e3, "o", color=INK, markersize=3.5, label="cells")
        hoop.set(title="(b) elastic tube", xlabel="Radius (m)", ylabel="Hoop stress (kPa)", ylim=(0, None))
        hoop.legend(loc="upper right")
        start = REFERENCE["impact"]
        width, height = 1e3 * start["radius"], 1e3 * start["length"]
        outline.plot([-width, -width, width, width], [0, height, height, 0], color=GREY, linewidth=1.0, label="before")
        sides = np.concatenate([-rod.radius, rod.radius[::-1]])
        levels = np.concatenate([rod.height, rod.height[::-1]])
        outline.plot(1e3 * sides, 1e3 * levels, color=INK, label="after")
        outline.axhline(1e3 * expected_length, **LINES[1], label="length, Wilkins and Guinan")
        outline.set(title="(c) rod on an anvil", xlabel="Across (mm)", ylabel="Height (mm)", ylim=(0, None))
        outline.set(xlim=(-10, 26))
        outline.legend(loc="upper right")
        for (label, cell), style in zip(cells.items(), LINES, strict=False):
            softening.plot(cell.strain, cell.exact / 1e6, **_EXACT)
            softening.plot(cell.strain, cell.stress / 1e6, label=label, **style)
        softening.set(title="(d) softening of a cell", xlabel="Logarithmic strain", ylabel="Stress (MPa)")
        softening.legend(loc="upper right")
    return path


def _draw_bar(axis: Axes, bar: Bar) -> None:
    unit = bar.length / bar.speed
    for number, (place, style) in enumerate(zip(bar.place, (LINES[0], LINES[1]), strict=True)):
        arrival, end = place / bar.length, 2.0 - place / bar.length
        exact = bar.plateau / 1e6
        axis.plot([0, arrival, arrival, end, end, 2], [0, 0, exact, exact, 0, 0], **_EXACT)
        label = f"{place / bar.length:.2f} of the length from the wall"
        axis.plot(bar.time / unit, -bar.stress[:, number] / 1e6, label=label, **style)
    axis.set(title="(a) bar thrown on a wall", xlabel="Time × c / length", ylabel="Pressure along the bar (MPa)")
    axis.set_ylim(top=1.45 * bar.plateau / 1e6)
    axis.legend(loc="upper right")
