"""Runs of the single M107 over cells and attitudes, to their rows and their figure."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.attitudes.check import NAME, REFERENCE, check_cells, check_envelope, check_lean
from validation.attitudes.figure import draw
from validation.figures import keep_picture
from validation.runs import summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Run both fills over cell sizes, leans and the whole envelope."""
    cells, lean = REFERENCE["cells"], REFERENCE["lean"]
    sizes = cells["quick_sizes" if options.quick else "sizes"]
    size = options.cell_size or lean["quick_size" if options.quick else "size"]
    curves: dict[str, dict[str, Any]] = {}
    for fill in REFERENCE["cases"]:
        hazards = {one: _run(runs, rows, fill, one, "upright") for one in sizes}
        rows += check_cells(fill, {one: hazard for one, hazard in hazards.items() if hazard})
        leaning = {
            degrees: _run(runs, rows, fill, size, f"{degrees} deg")
            for degrees in lean["quick_degrees" if options.quick else "degrees"]
        }
        rows += check_lean(fill, {degrees: hazard for degrees, hazard in leaning.items() if hazard})
        envelope = _run(runs, rows, fill, size, "any")
        if envelope:
            curves[fill] = envelope["attitude"]
            rows += check_envelope(fill, curves[fill])
    if curves:
        path = draw(curves, runs.folder / f"{NAME}.png")
        if options.readme:
            keep_picture(path)


def _run(runs: Runs, rows: list[Row], fill: str, size: str, attitude: str) -> dict[str, Any] | None:
    """The part `hazard` of a run; None where its burst is not sound."""
    changes = {"round.*.attitude": attitude}
    name = f"{NAME}_{fill.lower().replace(' ', '_')}_{attitude.replace(' ', '_')}"
    folder = runs.run(name, REFERENCE["cases"][fill], size, changes, geometry="axisymmetric")
    summary = summary_of(folder)
    found = sound(NAME, summary, REFERENCE["sound"], f"{fill}, {attitude}, {size}")
    rows += [row for row in found if row.passed is False]
    return summary["hazard"] if all_passed(found) else None
