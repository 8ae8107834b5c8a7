"""The M107 of 1944: hazardous fragments, the lightest one's speed and the density, by distance."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.report.figures.drawing import GREY, INK, LINES
from validation.figures import picture
from validation.m107_1944.check import REFERENCE, TABLE

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from validation.m107_1944.counts import Counts

__all__ = ["draw"]


def draw(found: Mapping[str, Counts], path: Path) -> Path:
    """Write the figure as PNG; `found` are the counts by what they come from."""
    with picture(path, 3, height=3.2) as (number, speed, density):
        area = 4.0 * np.pi * TABLE.distance**2
        for axis, values in ((number, TABLE.number), (speed, TABLE.speed), (density, TABLE.number / area)):
            axis.plot(TABLE.distance, values, "o", color=INK, markersize=4, label="Table 56 (1944)", zorder=5)
        for (label, counts), style in zip(found.items(), LINES, strict=False):
            order = np.argsort(counts.distance)
            place, much = counts.distance[order], counts.number[order]
            number.plot(place, much, label=label, **style)
            density.plot(place, much / (4.0 * np.pi * place**2), label=label, **style)
            speed.plot(place, counts.speed[order], label=label, **style)
        limit = REFERENCE["hazard"]["density"]
        density.axhline(limit, color=GREY, linewidth=0.9, linestyle=":")
        density.annotate("1 per 55.7 m²", (TABLE.distance[0], limit), va="bottom", fontsize=7.5)
        number.set(title="(a) number of 79 J or more", ylabel="Fragments", ylim=(0, None))
        speed.set(title="(b) lightest of them", ylabel="Speed (m/s)", ylim=(0, None))
        density.set(title="(c) density", ylabel="Density (1/m²)", xscale="log", yscale="log")
        for axis in (number, speed, density):
            axis.set(xlabel="Distance (m)")
        speed.legend(loc="upper right")
    return path
