"""Long steel tubes from their runs to their rows and their figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.figures import keep_picture
from validation.runs import ROOT, summary_of
from validation.soundness import all_passed, sound
from validation.steel_tubes.check import NAME, REFERENCE, Along, along, check, outer_radius
from validation.steel_tubes.figure import draw

if TYPE_CHECKING:
    from typing import Any

    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study", "tube_of"]

FULL_SIZE, QUICK_SIZE = "6 mm", "10 mm"
MERIDIAN_SIZES = ("6 mm", "3 mm")
"""Of the axisymmetric bursts, beside the three-dimensional ones."""


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Burst a tube for every charge ratio and compare its middle with Gurney's formula."""
    size = options.cell_size or (QUICK_SIZE if options.quick else FULL_SIZE)
    tubes: dict[float, Along] = {}
    for ratio in REFERENCE["quick_charge_ratios" if options.quick else "charge_ratios"]:
        folder = runs.run(f"{NAME}_{ratio:g}", REFERENCE["case"], size, tube_of(ratio), stage="burst")
        summary = summary_of(folder)
        found = sound(NAME, summary, REFERENCE["sound"], f"C/M {ratio:g}")
        rows += found
        if not all_passed(found):
            continue  # void
        tubes[ratio] = along(folder / "burst_snapshot.h5")
        rows += check(ratio, tubes[ratio], summary["burst"])
        for cells in (size,) if options.quick or options.cell_size else MERIDIAN_SIZES:
            rows += _meridian(runs, ratio, cells)
    if tubes:
        path = draw(tubes, runs.folder / f"{NAME}.png")
        if options.readme:
            keep_picture(path)


def _meridian(runs: Runs, ratio: float, size: str) -> list[Row]:
    """The same tube as an axisymmetric burst; its rows inform."""
    name = f"{NAME}_2d_{ratio:g}"
    folder = runs.run(name, REFERENCE["case"], size, tube_of(ratio), stage="burst", geometry="axisymmetric")
    summary = summary_of(folder)
    label = f"C/M {ratio:g}, axisymmetric, {size}"
    found = sound(NAME, summary, REFERENCE["sound"], label)
    if not all_passed(found):
        return found
    return found + check(ratio, along(folder / "burst_snapshot.h5"), summary["burst"], label, verdict=False)


def tube_of(charge_ratio: float) -> dict[str, Any]:
    """Changes of the case that give the tube this mass of charge over that of steel."""
    from fragfield.case import load_case
    from fragfield.case.conversion.stages import burst_rounds

    (item,) = burst_rounds(load_case(ROOT / REFERENCE["case"]))
    profile = item.profile
    assert profile is not None  # the case gives its contours
    bore = 1e3 * float(profile.cavity.radius(0.0))
    outer = outer_radius(bore, charge_ratio, item.explosive.density, item.casing.density)
    return {"round.*.profile.outer.points": [[0.0, outer], [1e3 * profile.length, outer]]}
