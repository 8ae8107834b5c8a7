"""Draws the pictures of a stage while the next stages are computed, where a core is free."""

from __future__ import annotations

import os
from typing import TYPE_CHECKING

from fragfield.report.figures.side_by_side import FigureQueue
from fragfield.view.offscreen import library_fault

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["EARLY", "draw_early", "early_figures"]

EARLY = {"burst": "picture_of_burst", "break-up": "picture_of_fragments"}
"""By stage the picture that its files and those of earlier stages decide."""


def early_figures() -> FigureQueue | None:
    """A queue for the pictures of a run that is being computed; None where one core has to do it all."""
    return FigureQueue() if len(os.sched_getaffinity(0)) > 1 else None


def draw_early(figures: FigureQueue, folder: Path, stage: str) -> None:
    """Begin to draw what a stage, which is done, has decided."""
    if stage in EARLY and library_fault() is None:
        figures.add_picture(EARLY[stage], folder, folder)
