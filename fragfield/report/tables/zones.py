"""Fragments by polar zone, as arena tests report them: table and figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.numbers import number
from fragfield.report.blocks import Table
from fragfield.report.figures.drawing import LINES, new_figure

if TYPE_CHECKING:
    from collections.abc import Iterator

    from matplotlib.figure import Figure

    from flight.arena import ArenaTable
    from fragfield.report.reading.run_files import RunFiles


JOINER = "\u2060"  # no line breaks here
_WIDTH = 10.0  # degrees of a zone, where the tables allow it
_SUMS = ("number", "mass", "hazardous")


def wide_zones(table: ArenaTable, width: float = _WIDTH, energy: float = 79.0) -> dict[str, np.ndarray[Any, Any]]:
    """A table by zones of a width (degrees), or by its own where they do not fit in; as `ArenaTable.by_zone`."""
    found = table.by_zone(energy)
    edges = np.arange(0.0, 180.0 + 0.5 * width, width)
    at = np.searchsorted(np.round(table.zones, 6), np.round(edges, 6))
    if (at >= len(table.zones)).any() or np.abs(table.zones[np.minimum(at, len(table.zones) - 1)] - edges).max() > 1e-6:
        return found
    moment = np.add.reduceat(found["mass"] * found["mean_speed"], at[:-1])
    wide = {name: np.add.reduceat(found[name], at[:-1]) for name in _SUMS}
    wide["mean_speed"] = moment / np.maximum(wide["mass"], 1e-300)
    wide["max_speed"] = np.maximum.reduceat(found["max_speed"], at[:-1])
    return {"from_deg": edges[:-1], "to_deg": edges[1:], **wide}


def _table(run: RunFiles) -> ArenaTable | None:
    from flight.arena import ArenaTable

    path = run.folder / "arena.csv"
    return ArenaTable.read(path) if path.is_file() else None


def zone_table(run: RunFiles) -> Iterator[Table]:
    """Number, mass, speeds and hazardous number by zone."""
    table = _table(run)
    if table is None:
        return
    zones = wide_zones(table, energy=run.criteria.energy)
    lines = [
        (
            f"{zones['from_deg'][i]:g}{JOINER}–{JOINER}{zones['to_deg'][i]:g}", _short(zones["number"][i]),
            _short(zones["mass"][i]), _speed(zones, "mean_speed", i), _speed(zones, "max_speed", i),
            _short(zones["hazardous"][i]),
        )
        for i in range(len(zones["number"]))
    ]  # fmt: skip
    head = ("Degrees from the nose", "Number", "Mass (kg)", "Mean speed (m/s)", "Largest (m/s)", "Hazardous at launch")
    note = (
        "Of one round, mean over rounds and stored realisations; speed by mass. Hazardous: "
        f"{run.criteria.energy:.3g} J or more at launch. arena.csv holds zones of 5 degrees by mass group (Z-data)."
    )
    yield Table("Fragments by polar zone", head, tuple(lines), note)


def _short(value: float) -> str:
    """Three digits, no zeros after them; whole from 100 on."""
    return f"{value:,.0f}" if value >= 100.0 else f"{value:.3g}"


def _speed(zones: dict[str, Any], name: str, index: int) -> str:
    return number(round(float(zones[name][index]))) if zones["number"][index] > 0.0 else "–"


def zone_figure(run: RunFiles) -> Figure | None:
    """Numbers and speeds by zone."""
    table = _table(run)
    if table is None:
        return None
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
