"""The copper cylinder test from its runs to its rows and its figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.copper_cylinder.check import MODELS, NAME, REFERENCE, check
from validation.copper_cylinder.figure import draw
from validation.copper_cylinder.streak import Streak, streak
from validation.figures import keep_picture
from validation.runs import summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

FULL_SIZE, COARSER_SIZE, QUICK_SIZE = "1.6 mm", "2 mm", "2.5 mm"
DEFAULT = "landau_cj"


def study(options: Options, runs: Runs) -> list[Row]:
    """Burst the cylinder with every product model; in full also the default model with larger cells, to inform."""
    size = options.cell_size or (QUICK_SIZE if options.quick else FULL_SIZE)
    wanted = [(model, size) for model in MODELS]
    if not options.quick and not options.cell_size:
        wanted.append((DEFAULT, COARSER_SIZE))
    rows: list[Row] = []
    records: dict[str, Streak] = {}
    for model, cells in wanted:
        folder = runs.run(f"{NAME}_{model}", REFERENCE["case"], cells, {"burst.products": model}, stage="burst")
        summary = summary_of(folder)
        label = model if cells == size else f"{model}, cells of {cells}"
        found = sound(NAME, summary, REFERENCE["sound"], label)
        rows += found
        if not all_passed(found):
            continue  # void
        record = streak(folder / "burst.h5", REFERENCE["station"], summary["burst"]["rounds"][0]["length"])
        rows += check(label, record, verdict=cells == size)
        if cells == size:
            records[model] = record
    if records:
        path = draw(records, runs.folder / f"{NAME}.png")
        if options.readme:
            keep_picture(path)
    return rows
