"""The M107 over cell sizes, from its runs to its rows."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from validation.m107_convergence.check import NAME, REFERENCE, WallProfile, check_distances, check_wall, wall_profile
from validation.runs import summary_of
from validation.soundness import all_passed, sound

if TYPE_CHECKING:
    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Run both fills at every cell size to the report, and compare sizes with the finest one."""
    sizes = [options.cell_size] if options.cell_size else REFERENCE["quick_sizes" if options.quick else "sizes"]
    for fill, case in REFERENCE["cases"].items():
        hazards: dict[str, dict[str, Any]] = {}
        profiles: dict[str, WallProfile] = {}
        for size in sizes:
            folder = runs.run(f"{NAME}_{fill.lower().replace(' ', '_')}", case, size)
            summary = summary_of(folder)
            found = sound(NAME, summary, REFERENCE["sound"], f"{fill}, {size}")
            rows += found
            if not all_passed(found):
                continue  # void
            hazards[size] = summary["hazard"]
            profiles[size] = wall_profile(folder / "burst_snapshot.h5")
        if hazards:
            rows += check_distances(fill, hazards)
        if profiles and fill == REFERENCE["wall"]["case"]:
            rows += check_wall(profiles)
