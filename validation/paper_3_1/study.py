"""Case 3.1 from its runs to its rows and the README's tables."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.paper_3_1.check import FIGURES, QUICK_SIZE, REFERENCE, SIZES, check, readme_tables
from validation.readme import copy_figures, insert_tables
from validation.runs import summary_of

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

NAME = "paper_3_1"


def study(options: Options, runs: Runs) -> list[Row]:
    """Run the case at every size, compare the finest; with `options.run` compare that run alone."""
    if options.run is not None:
        return check(summary_of(options.run))
    sizes = (QUICK_SIZE,) if options.quick else SIZES
    if options.cell_size:
        sizes = (options.cell_size,)
    folders = {size: runs.run(NAME, REFERENCE["case"], size) for size in sizes}
    summaries = {size: summary_of(folder) for size, folder in folders.items()}
    finest = sizes[-1]
    if options.readme:
        insert_tables(readme_tables(summaries, folders[finest] / "burst_snapshot.h5"))
        copy_figures(folders[finest] / "figures", FIGURES, NAME)
    return check(summaries[finest])
