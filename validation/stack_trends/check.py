"""The focus of a row of rounds in few numbers, and rows on how these must go with gap, delay and number of rounds."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from validation.files import reference_beside, snapshot_of
from validation.rows import Row, within
from validation.runs import StudyError

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = ["NAME", "REFERENCE", "Focus", "count_rows", "delay_rows", "end_row", "focus_of", "gap_rows", "speed_row"]

NAME = "stack_trends"
REFERENCE = reference_beside(__file__)

_NARROW = 10.0  # degrees about the focus direction
_WITHIN = 35.0


@dataclass(frozen=True)
class Focus:
    """Metal about the focus direction, +y or -y for rounds in a row along x, seen from above.

    Attributes
    ----------
    share : of the casings' mass within 10 degrees of it.
    half_angle : degrees within which half of the metal flies; 45 for a single round.
    lean : mean of the sine of the angle from the focus direction towards +x, of the metal within 35 degrees.
    place : m, mean x of the same metal.
    fastest : m/s, below which 99 % of the metal within 10 degrees flies.
    """

    share: float
    half_angle: float
    lean: float
    place: float
    fastest: float


def focus_of(snapshot: Path) -> Focus:
    """Read the focus off burst_snapshot.h5.

    Raises
    ------
    StudyError
        The file is no snapshot.
    """
    with snapshot_of(snapshot) as file:
        casing = file["cells/part"][()] == 0
        cells = file["cells/nodes"][()][casing]
        velocity = file["nodes/velocity"][()][cells].mean(axis=1)
        x = file["nodes/position"][()][cells, 0].mean(axis=1)
        mass = file["cells/mass"][()][casing]
    off = np.degrees(np.arctan2(velocity[:, 0], np.abs(velocity[:, 1])))
    order = np.argsort(np.abs(off))
    together = np.cumsum(mass[order]) / mass.sum()
    narrow, near = np.abs(off) <= _NARROW, np.abs(off) <= _WITHIN
    speed = np.linalg.norm(velocity, axis=1)
    by_speed = np.argsort(speed[narrow])
    slower = np.cumsum(mass[narrow][by_speed])
    return Focus(
        share=float(mass[narrow].sum() / mass.sum()),
        half_angle=float(np.abs(off)[order][np.searchsorted(together, 0.5)]),
        lean=float((mass[near] * np.sin(np.radians(off[near]))).sum() / mass[near].sum()),
        place=float(mass[near] @ x[near] / mass[near].sum()),
        fastest=float(speed[narrow][by_speed][np.searchsorted(slower, 0.99 * slower[-1])]),
    )


def gap_rows(found: Mapping[float, Focus], single: Focus) -> list[Row]:
    """With the gap (calibres) the focus weakens and widens; far apart it is that of the single round."""
    source, rows = REFERENCE["source"], []
    for (near, one), (far, other) in pairwise(sorted(found.items())):
        name = f"gap {far:g} against {near:g} calibres"
        rows.append(within(NAME, f"{name}: share within 10 deg, ratio", other.share / one.share, 0.0, 1.0, source))
        ratio = other.half_angle / one.half_angle
        rows.append(within(NAME, f"{name}: angle that holds half, ratio", ratio, 1.0, np.inf, source))
    farthest = max(found)
    ratio, far = found[farthest].share / single.share, REFERENCE["allowed"]["far"]
    name = f"gap {farthest:g} calibres: share within 10 deg over the single round's"
    rows.append(within(NAME, name, ratio, 1.0 - far, 1.0 + far, source))
    return rows


def delay_rows(found: Mapping[float, tuple[Focus, Focus]], together: Focus) -> list[Row]:
    """Of two rounds the left or the right is delayed (s): mirrored results, and the focus moves to the later round.

    The wall of the round that is initiated first has come farther when they meet, so that they meet beyond the middle
    plane, on the side of the later round, and the farther the longer the delay. The direction of the focused metal
    hardly changes: the earlier wall comes with more speed, the gas behind the later one with more pressure.
    """
    source, allowed, rows = REFERENCE["source"], REFERENCE["allowed"], []
    before = together
    for delay, (left, right) in sorted(found.items()):
        name, swapped, apart = f"delay {1e6 * delay:g} us", allowed["swapped"], allowed["swapped_place"]
        ratio = left.share / right.share
        rows.append(
            within(NAME, f"{name}: share, left delayed over right delayed", ratio, 1 - swapped, 1 + swapped, source)
        )
        both = 1e3 * (left.place + right.place)
        rows.append(within(NAME, f"{name}: places, sum of both", both, -1e3 * apart, 1e3 * apart, source, "mm"))
        further = 1e3 * (right.place - before.place)
        rows.append(within(NAME, f"{name}: place, further to the later round", further, 0.0, np.inf, source, "mm"))
        lean = allowed["lean"]
        rows.append(within(NAME, f"{name}: sine of the lean to the later round", right.lean, -lean, lean, source))
        before = right
    return rows


def end_row(delay: float, found: Sequence[Focus | None]) -> Row:
    """Of the two bursts with one delay (s), how many reached their end; the others stopped for their numbers."""
    ended = sum(one is not None for one in found)
    return within(
        NAME, f"delay {1e6 * delay:g} us: bursts that reach their end, of 2", ended, 2, 2, REFERENCE["source"]
    )


def count_rows(found: Mapping[int, Focus]) -> list[Row]:
    """A longer row has more gaps to a round: (n - 1)/n of them, and the focus' share grows."""
    rows = []
    for (few, one), (many, other) in pairwise(sorted(found.items())):
        name = f"row of {many} against {few}: share within 10 deg, ratio"
        rows.append(
            within(NAME, name, other.share / one.share, 1.0, (1 - 1 / many) / (1 - 1 / few), REFERENCE["source"])
        )
    return rows


def speed_row(pair: Focus, single_largest: float) -> Row:
    """Fastest metal of the pair's focus over the single round's largest speed (m/s)."""
    low, high = REFERENCE["allowed"]["speed"]
    ratio = pair.fastest / single_largest
    return within(
        NAME, "fastest of the focus over the single round's largest", ratio, low, high, REFERENCE["tp12_source"]
    )


def varied(text: str, *, count: int, gap: float, delays: Sequence[float], end: float) -> str:
    """The case's text with a number of rounds, a gap (m), delays and an end (s) of its own."""
    times = ", ".join(f'"{1e6 * delay:g} us"' for delay in delays)
    for old, new in (
        ("count = 2", f"count = {count}"),
        ('gap = "21.7 mm"', f'gap = "{1e3 * gap:g} mm"'),
        ('delays = ["0 us", "0 us"]', f"delays = [{times}]"),
        ('end_time = "120 us"', f'end_time = "{1e6 * end:g} us"'),
    ):
        if text.count(old) != 1:
            raise StudyError(f"stack_trends: the case must have {old!r} once")
        text = text.replace(old, new)
    return text
