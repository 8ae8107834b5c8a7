"""`fragfield view RUN`: a window where there is a display, otherwise pictures; pages on request."""

from __future__ import annotations

import importlib
import json
import logging
import os
import sys
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield.report.figures.drawing import SPEED_MAP
from fragfield.report.reading.run_files import RunFiles, read_run
from fragfield.view.offscreen import (
    DONE,
    INPUT,
    UNAVAILABLE,
    VIEWS,
    PictureProcess,
    PictureUnavailableError,
    display_available,
    use_offscreen,
)
from fragfield.view.scenes import final_burst, fragment_points, section

if TYPE_CHECKING:
    from collections.abc import Callable

_log = logging.getLogger(__name__)


def view_run(run_dir: Path | str, *, window: bool | None = None, html: bool = False) -> list[Path]:
    """Open the run in a window, or write its pictures, or its interactive pages.

    Parameters
    ----------
    run_dir : Path
        The run.
    window : bool, optional
        Open a window; left out: where a display is present.
    html : bool
        Write interactive 3-D pages, and nothing else.

    Returns
    -------
    list of Path
        Files written; empty after a window.

    Raises
    ------
    InputError
        Nothing to look at: neither the burst nor the break-up has been run.
    PictureUnavailableError
        VTK cannot draw here, or a package that the pages need is missing.
    """
    run = read_run(Path(run_dir))
    if not run.nodes and not run.fragments:
        raise InputError(f"{run.folder}: nothing to show; run `fragfield burst` or `fragfield break-up` first")
    if not html and window is not False:
        if display_available():
            open_window(run)
            return []
        named = f"no X server answers at DISPLAY={os.environ['DISPLAY']}" if os.environ.get("DISPLAY") else ""
        if window:
            raise PictureUnavailableError(
                f"no window can be opened: {named or 'DISPLAY is not set'}; allowed: --pictures"
            )
        if named:
            _log.warning("%s: pictures are written instead of a window", named)
    with PictureProcess(run.folder, run.folder, "pages" if html else "pictures") as process:
        if fault := process.finish():
            raise PictureUnavailableError(fault)
    names = VIEWS.values() if html else (f"figures/{name}.png" for name in VIEWS)
    return [run.folder / name for name, there in zip(names, (run.nodes, run.fragments), strict=True) if there]


def open_window(run: RunFiles) -> None:
    """Show the section of the burst and the fragments side by side until the window is closed."""
    import pyvista

    both = bool(run.nodes) and bool(run.fragments)
    plotter = pyvista.Plotter(shape=(1, 2) if both else (1, 1), title=run.title)
    plotter.set_background("white")
    bar = {"title": "Speed (m/s)", "color": "black", "n_labels": 5, "fmt": "%.0f"}
    if run.nodes:
        plotter.add_mesh(section(final_burst(run)), scalars="speed", cmap=SPEED_MAP, scalar_bar_args=dict(bar))
        plotter.add_axes()
        plotter.view_xz()
    if both:
        plotter.subplot(0, 1)
    if run.fragments:
        points, _ = fragment_points(run, streak=1e-4)
        plotter.add_mesh(
            points, scalars="speed", cmap=SPEED_MAP, render_points_as_spheres=True, point_size=5,
            scalar_bar_args={**bar, "title": "Initial speed (m/s)"},
        )  # fmt: skip
        plotter.view_isometric()
    plotter.show()


def draw(run: str, folder: str, what: str) -> int:
    """Draw pictures and pages of a run as `PictureProcess` asks; an exit code, and why on stderr."""
    use_offscreen()
    from fragfield.view.interactive import interactive_fault, write_interactive_views
    from fragfield.view.pictures import write_pictures

    def draw_views(files: RunFiles) -> None:
        if what != "pages":
            write_pictures(files, Path(folder) / "figures", wide=what == "pictures")
        if what == "pages" or (what != "pictures" and not interactive_fault()):
            write_interactive_views(files, Path(folder))

    try:
        if what == "run":
            _follow(Path(run), draw_views)
        else:
            draw_views(read_run(Path(run), flown=False, case=False))
    except (PictureUnavailableError, InputError) as error:
        sys.stderr.write(f"{error}\n")
        return INPUT if isinstance(error, InputError) else UNAVAILABLE
    return DONE


def _follow(run: Path, draw_views: Callable[[RunFiles], None]) -> None:
    """Load all libraries, then draw each stage whose name is read; the figures go to stdout after the last one."""
    from fragfield.report.stage_sections import figures_of_stage

    for name in ("fragfield.case", "matplotlib.backends.backend_svg", "pyvista.plotting"):
        importlib.import_module(name)
    figures: dict[str, str | None] = {}
    for line in sys.stdin:
        stage = line.strip()
        files = read_run(run, flown=stage == "fly")
        figures |= figures_of_stage(files, stage)
        if stage == "fly":
            json.dump(figures, sys.stdout)
            return
        (files.fragments if stage == "burst" else files.nodes).clear()  # drawn later, or before
        draw_views(files)
