"""The detonation products from their laws and an initiated charge to their rows and their figure."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.figures import keep_picture
from validation.products.check import MODELS, NAME, REFERENCE, check_laws, check_progressive
from validation.products.figure import draw
from validation.runs import summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

FULL_SIZES, QUICK_SIZES = ("10 mm", "5 mm", "3 mm"), ("5 mm",)


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Check the laws, then initiate a charge with each model; the finest cells are compared, the others drawn."""
    rows += check_laws()
    sizes = (options.cell_size,) if options.cell_size else QUICK_SIZES if options.quick else FULL_SIZES
    balances: dict[tuple[str, float], float] = {}
    for model in MODELS:
        changes = {
            "burst.products": model,
            "burst.end_time": REFERENCE["end_time"],
            "burst.leakage.enabled": False,
        }
        for size in sizes:
            summary = summary_of(runs.run(f"{NAME}_{model}", REFERENCE["case"], size, changes, stage="burst"))
            burst = summary["burst"]
            balances[model, burst["cell_size"]] = burst["products_balance"]
        found = sound(NAME, summary, REFERENCE["sound"], f"tnt, {model}")
        rows += found
        if all_passed(found):
            rows += check_progressive(model, burst)
    path = draw(balances, runs.folder / f"{NAME}.png")
    if options.readme:
        keep_picture(path)
