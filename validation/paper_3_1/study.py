"""Case 3.1 from its runs to its rows and the README's tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.paper_3_1.check import (
    FIGURES,
    MERIDIAN_SIZES,
    QUICK_SIZE,
    REFERENCE,
    SIZES,
    check,
    meridian_rows,
    readme_tables,
)
from validation.paper_3_1.numbers import draw_numbers, number_rows, numbers_of_run
from validation.readme import PICTURES, copy_figures, insert_tables
from validation.runs import summary_of
from validation.soundness import all_passed

if TYPE_CHECKING:
    from pathlib import Path

    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

NAME = "paper_3_1"


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Run the case at every size, compare the finest; with `options.run` compare that run alone."""
    if options.run is not None:
        _compare(options.run, rows)
        return
    sizes = (QUICK_SIZE,) if options.quick else SIZES
    if options.cell_size:
        sizes = (options.cell_size,)
    finest = sizes[-1]
    shown = finest if options.readme else None  # what is compared is reported by the burst; pictures are the report's
    folders = {
        size: runs.run(NAME, REFERENCE["case"], size, stage="run" if size == shown else "burst") for size in sizes
    }
    summaries = {size: summary_of(folder) for size, folder in folders.items()}
    _compare(folders[finest], rows)
    meridian = {}
    for size in sizes if options.quick or options.cell_size else MERIDIAN_SIZES:
        folder = runs.run(f"{NAME}_2d", REFERENCE["case"], size, stage="burst", geometry="axisymmetric")
        meridian[size] = summary_of(folder)
    rows += meridian_rows(meridian)
    if options.readme:
        insert_tables(readme_tables(summaries, folders[finest] / "burst_snapshot.h5", meridian))
        copy_figures(folders[finest] / "figures", FIGURES, NAME)
        draw_numbers(numbers_of_run(folders[finest]), PICTURES / f"{NAME}_samplers.png")


def _compare(folder: Path, rows: list[Row]) -> None:
    """Add the rows of a run; those of its fragments where its burst is sound and kept."""
    rows += (found := check(summary_of(folder)))
    if all_passed(found[:2]) and (folder / "burst_snapshot.h5").is_file():
        rows += number_rows(numbers_of_run(folder))
