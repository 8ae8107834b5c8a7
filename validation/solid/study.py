"""The solid's checks from their bodies to their rows and their figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba

from validation.figures import keep_picture
from validation.solid.check import (
    NAME,
    REFERENCE,
    check_bar,
    check_impact,
    check_softening,
    check_static,
    check_tube,
)

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Compute the bodies in this process, coarse ones only where it shall be quick."""
    # Bodies of a few cells are slower on several threads; results are the same.
    threads = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        _compute(options, runs, rows)
    finally:
        numba.set_num_threads(threads)


def _compute(options: Options, runs: Runs, rows: list[Row]) -> None:
    from validation.solid.bar import bar_on_wall
    from validation.solid.elastic_tube import elastic_tube, static_tube
    from validation.solid.figure import draw
    from validation.solid.impact import final_length, impact
    from validation.solid.softening import in_shear, in_tension
    from validation.solid.tube import plastic_tube

    cells = "quick_cells" if options.quick else "cells"
    bar = bar_on_wall(REFERENCE["bar"], REFERENCE["bar"][cells])
    rows += check_bar(bar)
    values = REFERENCE["tube"]
    elastic, plastic = elastic_tube(values, values[cells]), plastic_tube(values, values[cells])
    rows += check_tube(elastic, plastic)
    rows += check_static(elastic, static_tube(values, values[cells] // 2))
    values = REFERENCE["impact"]
    expected = final_length(values)
    counts = [values["quick_core_cells"]] if options.quick else [values["quick_core_cells"], values["core_cells"]]
    rods = [impact(values, core) for core in counts]
    for core, rod in zip(counts, rods, strict=True):
        rows += check_impact(f"impact, {2 * core} cells across", rod, expected)
    sound = [rod for rod in rods if abs(rod.energy_error) <= REFERENCE["sound"]["energy_error"]]
    softened = {"shear": in_shear(REFERENCE["softening"]), "tension": in_tension(REFERENCE["softening"])}
    for label, cell in softened.items():
        rows += check_softening(f"softening in {label}", cell)
    path = draw(bar, elastic, (sound or rods)[-1], expected, softened, runs.folder / f"{NAME}.png")
    if options.readme:
        keep_picture(path)
