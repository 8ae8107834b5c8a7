"""Two runs by polar zone, as arena tests report fragments."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from flight.arena import ArenaTable
    from fragfield.studies.compare.runs import ComparedRun

__all__ = ["compare_zones", "wide_zones"]

WIDTH = 10.0
"""Degrees of a zone, where the tables allow it."""
_SUMS = ("number", "mass", "hazardous")


def wide_zones(table: ArenaTable, width: float = WIDTH, energy: float = 79.0) -> dict[str, np.ndarray[Any, Any]]:
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


def compare_zones(run: ComparedRun, reference: ComparedRun) -> list[dict[str, Any]]:
    """Rows by polar zone with values of both and their ratio; empty where a run has no arena table, or zones differ."""
    from flight.arena import ArenaTable

    files = [one.folder / "arena.csv" for one in (run, reference)]
    if not all(path.is_file() for path in files):
        return []
    ours, theirs = (wide_zones(ArenaTable.read(path)) for path in files)
    if not np.array_equal(ours["from_deg"], theirs["from_deg"]):
        return []
    rows = []
    for zone in range(len(ours["from_deg"])):
        row: dict[str, Any] = {name: float(ours[name][zone]) for name in ("from_deg", "to_deg")}
        for name in ("number", "mass", "mean_speed", "max_speed", "hazardous"):
            mine, other = float(ours[name][zone]), float(theirs[name][zone])
            row[name] = {"run": mine, "reference": other, "ratio": mine / other if other > 0.0 else None}
        rows.append(row)
    return rows
