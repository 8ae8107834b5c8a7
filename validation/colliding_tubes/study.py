"""Two colliding tubes from their runs to their rows."""

from __future__ import annotations

from typing import TYPE_CHECKING

from validation.colliding_tubes.check import NAME, REFERENCE, Metal, check, check_pair, middle_of
from validation.runs import summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Burst one tube before a plane at every cell size, and in full two tubes without a plane at one of them."""
    sizes = [options.cell_size] if options.cell_size else REFERENCE["quick_sizes" if options.quick else "sizes"]
    computed: dict[str, Metal] = {}
    for size in sizes:
        folder = runs.run(NAME, REFERENCE["case"], size, stage="burst")
        summary = summary_of(folder)
        found = sound(NAME, summary, REFERENCE["sound"], size)
        rows += found
        if not all_passed(found):
            continue  # void
        (computed[size],) = middle_of(folder / "burst_snapshot.h5")
        rows += check(size, computed[size], summary["burst"])
    size = REFERENCE["full_pair_size"]
    if size in computed:
        folder = runs.run(f"{NAME}_pair", REFERENCE["pair"], size, stage="burst")
        summary = summary_of(folder)
        found = sound(NAME, summary, REFERENCE["sound"], f"two tubes, {size}")
        rows += found
        if all_passed(found):
            pair = middle_of(folder / "burst_snapshot.h5")
            rows += check_pair(f"two tubes, {size}", pair, computed[size], summary["burst"])
