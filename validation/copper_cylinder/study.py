"""The copper cylinder test: the speed of the wall as a streak camera sees it, with every product model."""

from __future__ import annotations

import math

from transition import Snapshot
from validation.copper_cylinder.streak import streak
from validation.rows import Rows
from validation.runs import Geometry, Runs, reference_beside

__all__ = ["REFERENCE", "study"]

REFERENCE = reference_beside(__file__)
SIZE, QUICK_SIZE, SOLID_SIZE = "0.8 mm", "1.6 mm", "1.6 mm"


def study(runs: Runs, rows: Rows) -> None:
    """Burst the cylinder in its meridian with every product model, and in full also in three dimensions."""
    wanted: list[tuple[str, str, Geometry]] = [
        (model, QUICK_SIZE if rows.quick else SIZE, "axisymmetric") for model in ("landau", "landau_cj", "jwl")
    ]
    if not rows.quick:
        wanted.append(("landau_cj", SOLID_SIZE, "3d"))
    needed = 1e3 * (max(REFERENCE["displacement"]) + REFERENCE["window"])
    for model, size, geometry in wanted:
        folder, _ = runs.burst(f"copper_cylinder_{model}", REFERENCE["case"], size, {"burst.products": model},
                                   geometry)  # fmt: skip
        length = Snapshot.read(folder / "burst_snapshot.h5").rounds[0].length
        record = streak(folder / "burst", REFERENCE["station"], length)
        label = f"{model}, cells of {size}" + (", three dimensions" if geometry == "3d" else "")
        reach = 1e3 * float(record.displacement.max())
        if not rows.bound(f"{label}: record of the wall ends at", reach, (needed, math.inf), "what is read of it",
                          "mm").passed:  # fmt: skip
            continue
        for displacement, measured in zip(REFERENCE["displacement"], REFERENCE["wall_speed"], strict=True):
            ours = record.speed_at(displacement, REFERENCE["window"])
            rows.compare(f"{label}: wall speed at {1e3 * displacement:g} mm", ours, measured, REFERENCE["source"],
                         "m/s", "explosive:tnt", f"products:{model}")  # fmt: skip
