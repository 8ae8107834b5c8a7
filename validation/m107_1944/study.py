"""The M107 of 1944, twice: with the law and speed that the table gives, and from the burst with nothing prescribed."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from transition import BreakUp
from validation.m107_1944.counts import FOOT, count, prescribed, read_table
from validation.runs import break_up_of, reference_beside

if TYPE_CHECKING:
    from validation.m107_1944.counts import Counts
    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "TABLE", "check", "study"]

REFERENCE = reference_beside(__file__)
TABLE = read_table(Path(__file__).parent / "table56.csv")
SIZE, QUICK_SIZE = "3 mm", "6 mm"
REALISATIONS, QUICK_REALISATIONS = 40, 10
SEED = 1944
_OF_FLIGHT = ("flight",)
_OF_BURST = ("burst", "break_up", "profile:m107", "explosive:tnt")


def study(runs: Runs, rows: Rows) -> None:
    """Count the table's fragments and those of the burst at the table's distances."""
    realisations = QUICK_REALISATIONS if rows.quick else REALISATIONS
    table = count(prescribed(REFERENCE, SEED, realisations), TABLE, REFERENCE, runs.threads)
    check(rows, "law prescribed", table, _OF_FLIGHT)
    folder, _ = runs.burst("m107_1944", REFERENCE["case"], QUICK_SIZE if rows.quick else SIZE)
    prepared = BreakUp(folder / "burst_snapshot.h5", break_up_of(folder))
    broken = [prepared.fragments(SEED, number) for number in range(realisations)]
    ours = count(broken, TABLE, REFERENCE, runs.threads)
    law, source = REFERENCE["law"], REFERENCE["source"]
    rows.compare("from the burst: mean initial speed", ours.initial_speed, REFERENCE["initial_speed"], source, "m/s",
                 *_OF_BURST)  # fmt: skip
    rows.compare("from the burst: fragments in all", ours.fragments, law["number"], "Mott's law through the table", "",
                 *_OF_BURST)  # fmt: skip
    rows.compare("from the burst: mean mass", 1e3 * ours.mean_mass, 2e3 * law["mu"], "Mott's law through the table",
                 "g", *_OF_BURST)  # fmt: skip
    check(rows, "from the burst", ours, _OF_BURST)


def check(rows: Rows, label: str, counts: Counts, subjects: tuple[str, ...]) -> None:
    """Hazardous fragments and the lightest one's speed at some of the table's distances, and the hazard distance."""
    source = REFERENCE["source"]
    for feet in REFERENCE["compared_ft"]:
        row = int(abs(TABLE.distance - FOOT * feet).argmin())
        rows.compare(f"{label}: hazardous fragments at {feet:g} ft", float(counts.number[row]),
                     float(TABLE.number[row]), source, "", *subjects)  # fmt: skip
        if counts.number[row]:
            rows.compare(f"{label}: speed of the lightest hazardous fragment at {feet:g} ft", float(counts.speed[row]),
                         float(TABLE.speed[row]), source, "m/s", *subjects)  # fmt: skip
    low, high = REFERENCE["hazardous_fragment_distance"]
    distance = counts.hazardous_distance(REFERENCE["hazard"]["density"])
    rows.compare(f"{label}: distance of 1 hazardous fragment in 55.7 m2", distance, 0.5 * (low + high), source, "m",
                 *subjects)  # fmt: skip
