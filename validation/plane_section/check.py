"""Rows of the plane section: speeds of a single round, convergence of the focus, trends."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.files import reference_beside, snapshot_of
from validation.grid import grid_index
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from validation.stack_trends.check import Focus

__all__ = [
    "NAME", "REFERENCE", "convergence_rows", "cylinder_speed", "delay_rows", "end_of", "friction_rows", "gap_rows",
    "mirrored_rows", "single_rows",
]  # fmt: skip

NAME = "plane_section"
REFERENCE = reference_beside(__file__)
WIDTHS = ("5", "10", "20", "35")

_ALLOWED, _SOURCE = REFERENCE["allowed"], REFERENCE["source"]


def end_of(gap: float, delay: float = 0.0) -> float:
    """End (s) of the burst of two rounds with a gap (m), one of them delayed (s): wider gaps take longer to close."""
    wider = max(gap - REFERENCE["gap"], 0.0)
    return float(REFERENCE["end"] + 0.5 * wider / REFERENCE["closing_speed"] + delay)


def cylinder_speed(snapshot: Path) -> float:
    """Mass-weighted casing speed (m/s) of a meridian between the cylinder's stations, from burst_snapshot.h5."""
    low, high = REFERENCE["cylinder"]
    with snapshot_of(snapshot) as file:
        along = file["rounds/0/along"][()]
    inside = (along["station"] >= low) & (along["station"] <= high)
    return float(np.average(along["mean_speed"][inside], weights=along["casing_mass"][inside]))


def single_rows(section: float, meridian: float, gurney: float) -> list[Row]:
    """Speed (m/s) of a single section beside the meridian's cylinder and Gurney's."""
    quantity = "single round: casing speed"
    return [
        compare(NAME, f"{quantity}, Gurney's cylinder", section, gurney, _ALLOWED["gurney"], "Eqs. 23, 24", "m/s"),
        compare(NAME, f"{quantity}, cylinder in the meridian", section, meridian, _ALLOWED["meridian"], _SOURCE, "m/s"),
    ]


def convergence_rows(sizes: Sequence[str], found: Sequence[Mapping[str, Any]]) -> list[Row]:
    """The focus at every size; of three or more the change between the two finest, and Roache's index.

    `found` are the entries `burst` of summary.json, from coarse to fine.
    """
    rows = []
    focus = [one["section"]["focus"] for one in found]
    for size, one in zip(sizes, focus, strict=True):
        for width in WIDTHS:
            quantity = f"{size}: mass per degree within {width} deg"
            rows.append(Row(NAME, quantity, one["mass_ratio"][width], None, None, None, None, "undisturbed = 1"))
        for key, words in (
            ("speed_99_percent", "speed of 99 % within 5 deg"),
            ("max_speed", "largest speed within 5 deg"),
        ):
            rows.append(Row(NAME, f"{size}: {words}", one[key], None, None, None, None, "no bound", "m/s"))
    if len(sizes) < 3:
        return rows
    before, last = focus[-2:]
    for width in WIDTHS:
        allowed = _ALLOWED["finest_narrow" if width == "5" else "finest_mass"]
        values = last["mass_ratio"][width], before["mass_ratio"][width]
        rows.append(compare(NAME, f"two finest: mass within {width} deg", *values, allowed, "the coarser of them"))
    values = last["speed_99_percent"], before["speed_99_percent"]
    allowed = _ALLOWED["finest_speed"]
    rows.append(compare(NAME, "two finest: speed of 99 %", *values, allowed, "the coarser of them", "m/s"))
    edges = [float(size.split()[0]) for size in sizes[-3:]]
    for width in WIDTHS:
        index = grid_index(edges, [one["mass_ratio"][width] for one in focus[-3:]]).index
        quantity = f"three finest: grid convergence index within {width} deg"
        rows.append(Row(NAME, quantity, index, None, None, None, None, "Roache 1994"))
    return rows


def mirrored_rows(whole: Mapping[str, Any], mirrored: Mapping[str, Any]) -> list[Row]:
    """Two whole rounds beside one before a plane of symmetry, entries `burst` of summary.json."""
    rows = []
    for width in WIDTHS[1:]:
        ours, reference = (one["section"]["focus"]["mass_ratio"][width] for one in (whole, mirrored))
        quantity = f"two whole rounds: mass within {width} deg"
        rows.append(compare(NAME, quantity, ours, reference, _ALLOWED["mirrored"], "one before a plane of symmetry"))
    return rows


def gap_rows(found: Mapping[float, Focus], single: float) -> list[Row]:
    """Share of mass within 10 degrees by gap (calibres): falls, at the widest one to the `single` round's."""
    rows = []
    for (near, one), (far, other) in pairwise(sorted(found.items())):
        quantity = f"gap {far:g} against {near:g} calibres: share within 10 deg, ratio"
        rows.append(within(NAME, quantity, other.share / one.share, 0.0, 1.0, _SOURCE))
    farthest = max(found)
    if farthest < REFERENCE["gaps"][-1]:
        return rows  # not all of them
    quantity = f"gap {farthest:g} calibres: share within 10 deg over the single round's"
    allowed = _ALLOWED["far"]
    rows.append(within(NAME, quantity, found[farthest].share / single, 1.0 - allowed, 1.0 + allowed, _SOURCE))
    return rows


def delay_rows(found: Mapping[float, tuple[Focus, Focus]], together: Focus) -> list[Row]:
    """The left or the right round delayed (s): mirrored results; metal gathers on the later round's side."""
    rows = []
    for delay, (left, right) in sorted(found.items()):
        name, swapped = f"delay {1e6 * delay:g} us", _ALLOWED["swapped"]
        ratio = left.share / right.share
        rows.append(
            within(NAME, f"{name}: share, left over right delayed", ratio, 1.0 - swapped, 1.0 + swapped, _SOURCE)
        )
        rows.append(within(NAME, f"{name}: share over undelayed", right.share / together.share, 0.0, 1.0, _SOURCE))
        rows.append(within(NAME, f"{name}: place to the later round", 1e3 * right.place, 0.0, np.inf, _SOURCE, "mm"))
    return rows


def friction_rows(found: Mapping[float, float | None], usual: float) -> list[Row]:
    """Mass ratio within 10 degrees by the friction angle of casings (degrees), beside the usual 20 degrees.

    None for a burst that stopped for its numbers.
    """
    rows = []
    for angle, ratio in sorted(found.items()):
        name = f"friction {angle:g} deg"
        if ratio is None:
            rows.append(within(NAME, f"{name}: burst reaches its end", 0.0, 1.0, 1.0, _SOURCE))
        else:
            rows.append(compare(NAME, f"{name}: mass within 10 deg", ratio, usual, _ALLOWED["friction"], "20 deg"))
    return rows
