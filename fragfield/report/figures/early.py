"""Draws pictures and figures of a stage while the next stages are computed, where a core is free."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from fragfield.report.figures import burst as burst_figures
from fragfield.report.figures import fragments as fragment_figures
from fragfield.report.figures.side_by_side import FigureQueue
from fragfield.report.reading.run_files import RunFiles
from fragfield.view.offscreen import library_fault

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.report.figures.side_by_side import Drawing

__all__ = ["EARLY", "draw_early", "early_figures"]

EARLY: dict[str, tuple[str, dict[str, Drawing]]] = {
    "burst": (
        "picture_of_burst",
        {
            "energy_ledger": burst_figures.energy_ledger,
            "speed_along_round": burst_figures.speed_along_round,
            "casing_over_time": burst_figures.casing_over_time,
        },
    ),
    "break-up": (
        "picture_of_fragments",
        {"number_by_mass": fragment_figures.number_by_mass, "directions": fragment_figures.directions},
    ),
}
"""By stage: the picture and the figures that its files alone, and those of earlier stages, decide."""


def early_figures(folder: Path) -> FigureQueue | None:
    """A queue for the figures of the run that is computed in a folder; None where one core has to do it all."""
    if len(os.sched_getaffinity(0)) < 2:
        return None
    return FigureQueue(RunFiles(folder), helped=True, fewest=1)


def draw_early(figures: FigureQueue, folder: Path, stage: str) -> None:
    """Begin to draw what a stage, which is done, has decided."""
    if stage not in EARLY:
        return
    picture, drawings = EARLY[stage]
    figures.renew(RunFiles(folder))
    if library_fault() is None:
        figures.add_picture(picture, folder)
    for name, function in drawings.items():
        figures.add(name, function)
