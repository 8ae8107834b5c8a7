"""The M107 of 1944, twice: with the law and speed that the table gives, and from the burst with nothing prescribed."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from transition import BreakUp
from validation.figures import keep_picture
from validation.m107_1944.check import NAME, REFERENCE, TABLE, check
from validation.m107_1944.counts import count, prescribed
from validation.m107_1944.figure import draw
from validation.runs import summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from pathlib import Path

    from flight import Fragments
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

FULL_SIZE, QUICK_SIZE = "3 mm", "8 mm"
REALISATIONS, QUICK_REALISATIONS = 40, 10
SEED = 1944
LAW, BURST = "law prescribed", "from the burst"
MERIDIAN = "from the axisymmetric burst"
MERIDIAN_SIZE = "1.5 mm"


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Count the table's fragments and those of the burst at the table's distances."""
    realisations = QUICK_REALISATIONS if options.quick else REALISATIONS
    found = {LAW: count(prescribed(REFERENCE, SEED, realisations), TABLE, REFERENCE, options.threads)}
    rows += check(LAW, found[LAW], from_burst=False)
    size = options.cell_size or (QUICK_SIZE if options.quick else FULL_SIZE)
    folder = runs.run(NAME, REFERENCE["case"], size, stage="burst")
    bounds = sound(NAME, summary_of(folder), REFERENCE["sound"], BURST)
    rows += bounds
    if all_passed(bounds):
        found[BURST] = count(_broken_up(folder, realisations), TABLE, REFERENCE, options.threads)
        rows += check(BURST, found[BURST], from_burst=True)
    rows += _meridian(options, runs, size if options.quick or options.cell_size else MERIDIAN_SIZE, realisations)
    path = draw(found, runs.folder / f"{NAME}.png")
    if options.readme:
        keep_picture(path)


def _meridian(options: Options, runs: Runs, size: str, realisations: int) -> list[Row]:
    """The same from the axisymmetric burst, beside that of three dimensions; its rows inform."""
    folder = runs.run(f"{NAME}_2d", REFERENCE["case"], size, stage="burst", geometry="axisymmetric")
    label = f"{MERIDIAN}, {size}"
    rows = sound(NAME, summary_of(folder), REFERENCE["sound"], label)
    if not all_passed(rows):
        return rows
    counts = count(_broken_up(folder, realisations), TABLE, REFERENCE, options.threads)
    return rows + [replace(row, tolerance=None, passed=None) for row in check(label, counts, from_burst=True)]


def _broken_up(folder: Path, realisations: int) -> list[Fragments]:
    """Realisations of the break-up of a run, by the law of its case."""
    from fragfield.case import read_resolved
    from fragfield.case.conversion.stages import break_up_settings

    prepared = BreakUp(folder / "burst_snapshot.h5", break_up_settings(read_resolved(folder / "case.toml")))
    return [prepared.fragments(SEED, number) for number in range(realisations)]
