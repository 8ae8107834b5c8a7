"""Long steel tubes: speed of the middle over the charge ratio, and what the open ends take away along the axis."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.report.figures.drawing import GREY, INK, LINES
from validation.figures import picture
from validation.steel_tubes.check import REFERENCE, gurney_speed, gurney_velocity

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from validation.steel_tubes.check import Along

__all__ = ["draw"]


def draw(tubes: Mapping[float, Along], path: Path) -> Path:
    """Write the figure as PNG; `tubes` are the speeds along the tubes by their charge ratio."""
    with picture(path, 2, height=3.4) as (gurney, along):
        ratios = np.geomspace(0.12, 1.2, 60)
        curve = np.array([gurney_speed(gurney_velocity(), ratio) for ratio in ratios])
        low, high = (np.array([gurney_speed(one, ratio) for ratio in ratios]) for one in REFERENCE["gurney"])
        allowed = REFERENCE["allowed"]["speed"]
        gurney.fill_between(ratios, low, high, color="0.75", linewidth=0, label="Gurney, range of √(2E)")
        for side in (1.0 - allowed, 1.0 + allowed):
            label = f"± {100 * allowed:g} %" if side < 1.0 else None
            gurney.plot(ratios, side * curve, color=GREY, linestyle=":", linewidth=1.0, label=label)
        middles = [speeds.mean(*REFERENCE["middle"]) for speeds in tubes.values()]
        gurney.plot(list(tubes), middles, "o", color=INK, markersize=4, label="computed, middle of the tube")
        shown = [0.15, 0.25, 0.4, 0.65, 1.0]
        gurney.set(xscale="log", xticks=shown, xticklabels=[f"{one:g}" for one in shown])
        gurney.minorticks_off()
        gurney.set(title="(a) speed of the middle", xlabel="Mass of charge over mass of steel", ylabel="Speed (m/s)")
        gurney.legend(loc="upper left")
        for (ratio, speeds), style in zip(tubes.items(), LINES, strict=False):
            wanted = gurney_speed(gurney_velocity(), ratio)
            along.plot(speeds.place, speeds.speed / wanted, label=f"{ratio:g}", **style)
        along.axhline(1.0, color=GREY, linewidth=0.8)
        along.axvspan(*REFERENCE["middle"], color="0.93", zorder=0)
        along.set(title="(b) along the tube, initiated at the left", xlabel="Station / length (eight bores)")
        along.set(ylabel="Speed over Gurney's", xlim=(0, 1), ylim=(0, None))
        along.legend(loc="lower center", title="charge over steel", ncols=2)
    return path
