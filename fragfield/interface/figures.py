"""The report's figures as matplotlib figures, drawn by the report's functions."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.errors import InputError, nearest

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from fragfield.report.blocks import Block, Illustration
    from fragfield.report.figures.drawing import Drawing
    from fragfield.report.reading.run_files import RunFiles

__all__ = ["draw", "figures_of"]


def figures_of(run: RunFiles) -> dict[str, tuple[str, Drawing]]:
    """By name: title and drawing function of every figure that the report of a run has, in its order."""
    from fragfield.report.sections import sections

    found: dict[str, tuple[str, Drawing]] = {}

    def note(name: str, title: str, caption: str, function: Drawing) -> list[Illustration]:
        del caption
        found[name] = (title, function)
        return []

    def no_picture(name: str, title: str, caption: str) -> list[Block]:
        del name, title, caption
        return []

    sections(run, note, no_picture)
    return found


def draw(run: RunFiles, name: str) -> Figure:
    """A figure by its name; raises InputError for another name, or where the run has no data for it."""
    from fragfield.report.figures.drawing import drawing_style

    known = figures_of(run)
    if name not in known:
        raise InputError(f"figure: found {name!r}{nearest(str(name), known)}; allowed: {', '.join(known)}")
    with drawing_style():
        figure = known[name][1](run)
        if figure is None:
            raise InputError(f"{run.folder}: holds no data for the figure {name} ({known[name][0]})")

    return figure
