"""Fragments by polar zone, as arena tests report them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.report.figures.drawing import LINES, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fragfield.report.reading.run_files import RunFiles


def zone_figure(run: RunFiles) -> Figure | None:
    """Numbers and speeds by zone."""
    from flight.arena import ArenaTable

    path = run.folder / "arena.csv"
    if not path.is_file():
        return None
    table = ArenaTable.read(path)
    zones = table.by_zone(run.criteria.energy)
    figure, (count, speed) = new_figure(2, 1, height=4.2, sharex=True)
    edges = table.zones
    for index, (name, label) in enumerate((("number", "all"), ("hazardous", "hazardous at launch"))):
        style = LINES[index]
        count.stairs(zones[name], edges, label=label, color=style["color"], linestyle=style["linestyle"])
    seen = zones["number"] > 0.0
    for index, (name, label) in enumerate((("mean_speed", "mean by mass"), ("max_speed", "largest"))):
        style = LINES[index]
        values = np.where(seen, zones[name], np.nan)
        speed.stairs(values, edges, label=label, color=style["color"], linestyle=style["linestyle"])
    count.set(ylabel="Fragments\nin a zone")
    count.set_ylim(bottom=0.0)
    speed.set(ylabel="Speed (m/s)", xlabel="Angle from the nose (°)", xlim=(0.0, 180.0), xticks=range(0, 181, 30))
    speed.set_ylim(bottom=0.0)
    for axis in (count, speed):
        axis.legend(loc="upper right")
    return figure
