"""The copper cylinder test from its runs to its rows and its figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.copper_cylinder.check import MODELS, NAME, REFERENCE, check
from validation.copper_cylinder.figure import draw
from validation.copper_cylinder.streak import Streak, streak
from validation.figures import keep_picture
from validation.runs import Geometry, summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

FULL_SIZE, COARSER_SIZE, QUICK_SIZE = "1.6 mm", "2 mm", "2.5 mm"
MERIDIAN_SIZES = ("1.6 mm", "0.8 mm", "0.4 mm")
"""Of the axisymmetric bursts, beside the three-dimensional ones: they show whether a miss is one of the cells."""
DEFAULT = "landau_cj"
THREE: Geometry = "3d"
MERIDIAN: Geometry = "axisymmetric"


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Burst the cylinder with every product model; in full also the default model with larger cells, to inform."""
    size = options.cell_size or (QUICK_SIZE if options.quick else FULL_SIZE)
    wanted = [(model, size, THREE) for model in MODELS]
    if not options.quick and not options.cell_size:
        wanted.append((DEFAULT, COARSER_SIZE, THREE))
    meridian = (size,) if options.quick or options.cell_size else MERIDIAN_SIZES
    wanted += [(model, cells, MERIDIAN) for model in MODELS for cells in meridian]
    records: dict[str, Streak] = {}
    for model, cells, geometry in wanted:
        judged = cells == size and geometry == THREE
        name = f"{NAME}_{model}" if geometry == THREE else f"{NAME}_2d_{model}"
        changes = {"burst.products": model}
        folder = runs.run(name, REFERENCE["case"], cells, changes, stage="burst", geometry=geometry)
        summary = summary_of(folder)
        label = model if judged else f"{model}, cells of {cells}"
        label += "" if geometry == THREE else ", axisymmetric"
        found = sound(NAME, summary, REFERENCE["sound"], label)
        rows += found
        if not all_passed(found):
            continue  # void
        record = streak(folder / "burst", REFERENCE["station"], summary["burst"]["rounds"][0]["length"])
        rows += check(label, record, verdict=judged)
        if judged:
            records[model] = record
    if records:
        path = draw(records, runs.folder / f"{NAME}.png")
        if options.readme:
            keep_picture(path)
