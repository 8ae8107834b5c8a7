"""The laws of the mean mass from the published data to their rows and their figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.figures import keep_picture
from validation.mean_mass.check import NAME, REFERENCE, check_bursts, check_laws
from validation.mean_mass.data import measured
from validation.mean_mass.figure import draw
from validation.runs import summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

FILLINGS = {"TNT": "tnt", "Composition B": "comp_b"}
FULL_SIZE, QUICK_SIZE = "2 mm", "3.2 mm"


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Compare the laws in closed form, then with the strain rates of the cylinder's own bursts."""
    rows += check_laws()
    size = options.cell_size or (QUICK_SIZE if options.quick else FULL_SIZE)
    folders = {}
    for explosive, filling in FILLINGS.items():
        changes = {"round.*.explosive": filling}
        folder = runs.run(f"{NAME}_{filling}", REFERENCE["case"], size, changes, stage="burst")
        found = sound(NAME, summary_of(folder), REFERENCE["sound"], f"cylinder, {explosive}")
        rows += found
        if all_passed(found):
            folders[explosive] = folder
    if len(folders) == len(FILLINGS):
        rows += check_bursts(folders)
    path = draw(measured(), runs.folder / f"{NAME}.png")
    if options.readme:
        keep_picture(path)
