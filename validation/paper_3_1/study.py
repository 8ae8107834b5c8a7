"""Section 3.1 of the paper: one 155 mm round with TNT, its speeds, its diameter, and the numbers of its fragments."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from transition import BreakUp, Snapshot
from validation.runs import break_up_of, reference_beside

if TYPE_CHECKING:
    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "number_rows", "study"]

REFERENCE = reference_beside(__file__)
SIZE, QUICK_SIZE = "3 mm", "6 mm"
REALISATIONS, SEED = 50, 31
STEP = 1e-3
"""Step dm of the paper's grades (kg); it states none."""
_LAW = "Mott's law, Eq. 19"


def study(runs: Runs, rows: Rows) -> None:
    """Burst the round in its meridian and compare it with the paper; then draw its fragments with both samplers."""
    folder, burst = runs.burst("paper_3_1", REFERENCE["case"], QUICK_SIZE if rows.quick else SIZE)
    source = REFERENCE["source"]
    rows.compare("mean initial speed", burst["mean_initial_speed"], REFERENCE["mean_initial_speed"], source, "m/s",
                 "burst")  # fmt: skip
    rows.compare("diameter at the end", 1e3 * burst["outer_diameter"], 1e3 * REFERENCE["diameter_at_end"], source, "mm",
                 "burst")  # fmt: skip
    (one,) = burst["rounds"]
    low, high = REFERENCE["fastest_between"]
    fastest = one["fastest_station"] / Snapshot.read(folder / "burst_snapshot.h5").rounds[0].length
    rows.bound("fastest place, fraction of the length from the nose (the paper: 0.25 to 0.5)", fastest, (low, high),
               source, "", "burst", kind="comparison")  # fmt: skip
    settings = break_up_of(folder)
    number_rows(rows, BreakUp(folder / "burst_snapshot.h5", settings))
    graded = BreakUp(folder / "burst_snapshot.h5", replace(settings, sampler="graded", graded_dm=STEP))
    casing = sum(law.mass for law in graded.laws)
    lost = 1.0 - float(graded.fragments(SEED).mass.sum()) / casing
    quantity = f"mass that the paper's grades of {1e3 * STEP:g} g leave out (Eqs. 26-29)"
    rows.trend(quantity, 100.0 * lost, None, _LAW, "%", "break_up")


def number_rows(rows: Rows, prepared: BreakUp) -> None:
    """The default sampler must hand over the whole mass, and the number of the law."""
    casing, expected = (sum(getattr(law, name) for law in prepared.laws) for name in ("mass", "n0"))
    drawn = prepared.many(SEED, range(REALISATIONS))
    worst = max(abs(float(one.mass.sum()) / casing - 1.0) for one in drawn)
    quantity = "fragments' mass over the casing's, less one"
    rows.bound(quantity, worst, (0.0, 1e-12), "conservation of mass", "", "break_up")
    number = float(np.mean([len(one) for one in drawn]))
    rows.verify(f"fragments, mean of {REALISATIONS} realisations", number, expected, 0.01, _LAW, "", "break_up")
    heavy = 4.0 * casing / expected  # twice the law's mu in mass, where N(m)/N0 is exp(-sqrt(8)) in two dimensions
    law = sum(law.n0 * float(law.law.survival(np.array([heavy]))[0]) for law in prepared.laws)
    ours = float(np.mean([(one.mass > heavy).sum() for one in drawn]))
    rows.verify("fragments of four times the mean mass or more", ours, law, 0.02, _LAW, "", "break_up")
