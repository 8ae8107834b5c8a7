"""Rows of the M107 of 1944: numbers, speeds, hazardous fragment distance."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from validation.files import reference_beside
from validation.m107_1944.counts import FOOT, read_table
from validation.rows import Row, compare

if TYPE_CHECKING:
    from validation.m107_1944.counts import Counts

__all__ = ["NAME", "REFERENCE", "TABLE", "check"]

NAME = "m107_1944"
_FOLDER = Path(__file__).parent
REFERENCE = reference_beside(__file__)
TABLE = read_table(_FOLDER / "table56.csv")


def check(label: str, counts: Counts, *, from_burst: bool) -> list[Row]:
    """Compare counted fragments with the table.

    Parameters
    ----------
    label : what the fragments come from.
    counts : at the table's distances first, in its order.
    from_burst : whether nothing was prescribed; then the initial speed is compared as well, and number and mean mass
        are reported.
    """
    allowed, source = REFERENCE["allowed"], REFERENCE["source"]
    rows = []
    if from_burst:
        wanted, law = REFERENCE["initial_speed"], REFERENCE["law"]
        fitted = f"Mott's law through the table ({source})"
        rows += [
            compare(
                NAME,
                f"{label}: mean initial speed",
                counts.initial_speed,
                wanted,
                allowed["initial_speed"],
                source,
                "m/s",
            ),
            compare(NAME, f"{label}: fragments in all", counts.fragments, law["number"], None, fitted),
            compare(NAME, f"{label}: mean mass", 1e3 * counts.mean_mass, 2e3 * law["mu"], None, fitted, "g"),
        ]
    judging = set(TABLE.gates(*(FOOT * edge for edge in REFERENCE["gates_ft"])).tolist())
    for kind, unit in (("number", ""), ("speed", "m/s")):
        ours, theirs = getattr(counts, kind), getattr(TABLE, kind)
        words = {"number": "hazardous fragments", "speed": "speed of the lightest hazardous fragment"}[kind]
        for row, distance in enumerate(TABLE.distance):
            quantity = f"{label}: {words} at {distance / FOOT:.0f} ft"
            tolerance = allowed[kind] if row in judging else None
            if ours[row] > 0.0:  # not a number where nothing hazardous gets so far
                rows.append(compare(NAME, quantity, float(ours[row]), float(theirs[row]), tolerance, source, unit))
            elif kind == "number":
                rows.append(compare(NAME, quantity, 0.0, float(theirs[row]), tolerance, source, unit))
    low, high = REFERENCE["hazardous_fragment_distance"]
    found = counts.hazardous_distance(REFERENCE["hazard"]["density"])
    quantity = f"{label}: hazardous fragment distance"
    # The nearer end of the table's range is what the distance is held against.
    wanted = min(max(found, low), high)
    return [*rows, compare(NAME, quantity, found, wanted, allowed["distance"], source, "m")]
