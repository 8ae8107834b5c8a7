"""`fragfield view RUN`: its pictures, or pyvista's window of the burst and the fragments."""

from __future__ import annotations

import os
import sys
from pathlib import Path

from fragfield.errors import InputError
from fragfield.report.figures.drawing import SPEED_MAP
from fragfield.report.reading.run_files import read_run
from fragfield.view.offscreen import PictureUnavailableError, drawing
from fragfield.view.scenes import STREAK, final_burst, fragment_points, section


def view_run(run_dir: Path | str, *, window: bool = False) -> list[Path]:
    """Write the pictures of a run into its folder `figures`; or open it in a window.

    Returns
    -------
    list of Path
        Files written; empty after a window.

    Raises
    ------
    InputError
        Nothing to look at: neither the burst nor the break-up has been run; or a window without a display.
    PictureUnavailableError
        VTK cannot draw here.
    """
    run = read_run(Path(run_dir))
    if not run.nodes and not run.fragments:
        raise InputError(f"{run.folder}: nothing to show; run `fragfield burst` or `fragfield break-up` first")
    if not window:
        folder = run.folder / "figures"
        with drawing(run.folder, folder, wide=True) as finish:
            if fault := finish():
                raise PictureUnavailableError(fault)
        names = ("picture_of_burst.png", "picture_of_fragments.png")
        return [folder / name for name, there in zip(names, (run.nodes, run.fragments), strict=True) if there]
    if sys.platform.startswith("linux") and not os.environ.get("DISPLAY"):
        raise InputError("--window: DISPLAY is not set; without --window pictures are written")
    import pyvista

    parts = []
    if run.nodes:
        parts.append((section(final_burst(run)), "Speed (m/s)"))
    if run.fragments:
        parts.append((fragment_points(run, STREAK)[0], "Initial speed (m/s)"))
    plotter = pyvista.Plotter(shape=(1, len(parts)), title=run.title)
    for place, (mesh, words) in enumerate(parts):
        plotter.subplot(0, place)
        plotter.add_mesh(mesh, scalars="speed", cmap=SPEED_MAP, point_size=5, scalar_bar_args={"title": words})
    plotter.show()
    return []
