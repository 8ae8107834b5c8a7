"""Hazard distance over the inclination of the axis, a curve a fill."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.figures import picture

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

__all__ = ["draw"]


def draw(curves: Mapping[str, Mapping[str, Any]], path: Path) -> Path:
    """Write the figure as PNG; `curves` are the parts `hazard.attitude` of summaries, by fill."""
    with picture(path, height=3.0) as (axis,):
        for fill, attitude in curves.items():
            rows = sorted(attitude["curve"], key=lambda row: row["inclination_deg"])
            degrees = [row["inclination_deg"] for row in rows]
            distances = [row["expected"] for row in rows]
            axis.errorbar(degrees, distances, [2.0 * row["standard_error"] for row in rows], marker="o", markersize=3,
                          linewidth=1.2, capsize=2, label=f"M107, {fill} (bars: two standard errors)")  # fmt: skip
        axis.set(xlabel="Inclination of the axis from upright (degrees)", ylabel="Hazard distance (m)", xlim=(-3, 183))
        axis.set_ylim(bottom=0.0)
        axis.set_xticks(range(0, 181, 15))
        axis.legend(loc="lower right")
    return path
