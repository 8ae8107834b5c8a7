"""The cylinder's expansion: displacement over time, and wall speed over displacement, by product model."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.report.figures.drawing import INK, LINES
from validation.copper_cylinder.check import REFERENCE
from validation.figures import picture

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from validation.copper_cylinder.streak import Streak

__all__ = ["draw"]

_SEEN = 1e-4  # m: below, the wall has not yet moved
_END = 22e-3


def draw(records: Mapping[str, Streak], path: Path) -> Path:
    """Write the figure as PNG: records by product model, and the test's two speeds with the tolerance."""
    with picture(path, 2, height=3.4) as (history, speed):
        for (model, record), style in zip(records.items(), LINES, strict=False):
            moving = (record.displacement > _SEEN) & (record.displacement < _END)
            start = np.interp(_SEEN, record.displacement, record.time)
            history.plot(1e6 * (record.time[moving] - start), 1e3 * record.displacement[moving], label=model, **style)
            slope = np.gradient(record.displacement, record.time)[moving]
            speed.plot(1e3 * record.displacement[moving], slope, label=model, **style)
        speed.errorbar(
            1e3 * np.array(REFERENCE["displacement"]), REFERENCE["wall_speed"],
            yerr=REFERENCE["allowed"]["wall_speed"] * np.array(REFERENCE["wall_speed"]),
            fmt="o", color=INK, markersize=4, capsize=3, linewidth=1.0, zorder=5,
            label=f"test, ± {100 * REFERENCE['allowed']['wall_speed']:g} %",
        )  # fmt: skip
        place = f"{1e3 * REFERENCE['station']:g} mm behind the initiated end"
        history.set(title="(a) expansion", xlabel=f"Time since the wall moved, {place} (µs)", xlim=(0, None))
        history.set(ylabel="Displacement of the outer radius (mm)", ylim=(0, 1e3 * _END))
        speed.set(title="(b) wall speed at the slit", xlabel="Displacement of the outer radius (mm)")
        speed.set(ylabel="Speed (m/s)", xlim=(0, 1e3 * _END), ylim=(500, None))
        history.legend(loc="upper left")
        speed.legend(loc="lower right")
    return path
