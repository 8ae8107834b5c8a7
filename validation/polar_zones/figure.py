"""Number per solid angle over the polar angle, a panel a contour, with the zones and the peak of the test."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.report.figures.drawing import GREY, INK
from validation.figures import picture
from validation.polar_zones.zones import REFERENCE

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["draw"]

_BIN = 2.5  # degrees


def draw(angles: Mapping[str, Mapping[str, NDArray[np.float64]]], realisations: int, path: Path) -> Path:
    """Write the figure as PNG.

    Parameters
    ----------
    angles : by contour, then by words for the scatter
        Polar angles of the fragments above 0.5 g of all realisations (degrees).
    realisations : int
        How many.
    """
    edges = np.arange(0.0, 180.0 + _BIN, _BIN)
    solid = 2.0 * np.pi * -np.diff(np.cos(np.radians(edges)))
    zones, peak = REFERENCE["zones"], REFERENCE["peak"]
    with picture(path, len(angles), height=3.0, sharey=True) as axes:
        for axis, (contour, curves) in zip(axes, angles.items(), strict=True):
            for (words, angle), line in zip(curves.items(), (":", "-"), strict=True):
                density = 0.01 * np.histogram(angle, edges)[0] / solid / realisations
                axis.stairs(density, edges, color=GREY if line == ":" else INK, linestyle=line, label=words)
            for number, zone in enumerate(zones.values()):
                label = "test, zones at 15 ft" if number == 0 else None
                axis.plot([zone["from"], zone["to"]], 2 * [zone["density"][0]], color="C3", linewidth=2.5, label=label)
            half = 0.5 * peak["width"]
            axis.plot([95.0 - half, 95.0 + half], 2 * [peak["density"][0]], color="C0", linewidth=2.5,
                      label="test, middle at 36 ft")  # fmt: skip
            axis.set(
                title=contour,
                xlabel="Angle from the nose (degrees)",
                yscale="log",
                xlim=(0.0, 180.0),
                ylim=(0.03, 12.0),
            )
            axis.set_xticks(range(0, 181, 30))
        axes[0].set(ylabel="Fragments per 0.01 sr")
        axes[-1].legend(loc="upper left", fontsize=6.5)
    return path
