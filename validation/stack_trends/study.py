"""What any correct model of a stack must show: trends over gap, delay and number of rounds, and exact symmetries."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.runs import ROOT, StudyError, reference_beside, snapshot_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "Focus", "check_counts", "check_delays", "check_gaps", "focus_of", "study", "varied"]

REFERENCE = reference_beside(__file__)
_NARROW = 10.0  # degrees about the focus direction
_WITHIN = 35.0
_SOURCE = REFERENCE["source"]


def study(runs: Runs, rows: Rows) -> None:
    """Burst single round, pairs over gaps and delays, and a longer row."""
    quick = "quick_" if rows.quick else ""
    calibre, pair_gap = REFERENCE["calibre"], REFERENCE["gap"]

    def burst(name: str, *, count: int = 2, gap: float = pair_gap, delays: Sequence[float] = ()) -> tuple[Focus, Any]:
        times = list(delays) or [0.0] * count
        text = (ROOT / REFERENCE["case"]).read_text(encoding="utf-8")
        runs.folder.mkdir(parents=True, exist_ok=True)
        path = runs.folder / f"stack_trends_{name}_case.toml"
        end = REFERENCE["end"] + max(times)
        path.write_text(varied(text, count=count, gap=gap, delays=times, end=end), encoding="utf-8")
        folder, values = runs.burst(f"stack_trends_{name}", str(path), REFERENCE[f"{quick}size"], geometry="3d")
        return focus_of(folder / "burst_snapshot.h5"), values

    single, alone = burst("single", count=1)
    pair, _ = burst("pair")
    gaps = {pair_gap / calibre: pair}
    gaps |= {gap: burst(f"gap_{gap:g}", gap=gap * calibre)[0] for gap in REFERENCE[f"{quick}gaps"]}
    check_gaps(rows, gaps, single)
    ratio = pair.fastest / float(alone["max_initial_speed"])
    rows.bound("fastest of the focus (99 % of the mass) over the single round's largest", ratio, (1.0, 2.0),
               REFERENCE["tp12_source"], kind="trend")  # fmt: skip
    counts = {count: burst(f"row_{count}", count=count)[0] for count in REFERENCE["counts"]}
    check_counts(rows, {2: pair} | counts)
    delays = {}
    for delay in REFERENCE[f"{quick}delays"]:
        left = burst(f"left_{1e6 * delay:g}_us", delays=(delay, 0.0))[0]
        delays[delay] = left, burst(f"right_{1e6 * delay:g}_us", delays=(0.0, delay))[0]
    check_delays(rows, delays, pair)


@dataclass(frozen=True)
class Focus:
    """Metal about the focus direction, +y or -y for rounds in a row along x, seen from above.

    Attributes
    ----------
    share : of the casings' mass within 10 degrees of it.
    half_angle : degrees within which half of the metal flies; 45 for a single round.
    place : m, mean x of the metal within 35 degrees.
    fastest : m/s, below which 99 % of the metal within 10 degrees flies.
    """

    share: float
    half_angle: float
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
        place=float(mass[near] @ x[near] / mass[near].sum()),
        fastest=float(speed[narrow][by_speed][np.searchsorted(slower, 0.99 * slower[-1])]),
    )


def check_gaps(rows: Rows, gaps: dict[float, Focus], single: Focus) -> None:
    """With the gap (calibres) the focus weakens and widens; far apart it is that of the single round."""
    for (near, one), (far, other) in pairwise(sorted(gaps.items())):
        name = f"gap of {far:.2g} over {near:.2g} calibres"
        rows.bound(f"{name}: mass within 10 deg, ratio", other.share / one.share, (0.0, 1.0), _SOURCE, kind="trend")
        ratio = other.half_angle / one.half_angle
        rows.bound(f"{name}: angle that holds half the mass, ratio", ratio, (1.0, np.inf), _SOURCE, kind="trend")
    farthest = max(gaps)
    rows.verify(f"gap of {farthest:g} calibres: mass within 10 deg over the single round's",
                gaps[farthest].share / single.share, 1.0, REFERENCE["far"], "no contact before the end")  # fmt: skip


def check_counts(rows: Rows, counts: dict[int, Focus]) -> None:
    """A longer row has more gaps to a round, (n - 1)/n of them, and the focus' part of the mass grows by less."""
    for (few, one), (many, other) in pairwise(sorted(counts.items())):
        most = (1 - 1 / many) / (1 - 1 / few)
        rows.bound(f"row of {many} over {few}: mass within 10 deg, ratio", other.share / one.share, (1.0, most),
                   _SOURCE, kind="trend")  # fmt: skip


def check_delays(rows: Rows, delays: dict[float, tuple[Focus, Focus]], together: Focus) -> None:
    """Of two rounds the left or the right is delayed (s): mirrored results, and the focus moves to the later round.

    The wall of the round that is initiated first has come farther when they meet, so that they meet beyond the middle
    plane, on the side of the later round, and the farther the longer the delay.
    """
    before = together
    for delay, (left, right) in sorted(delays.items()):
        name = f"delay of {1e6 * delay:g} us"
        rows.verify(f"{name}: mass within 10 deg, left delayed over right delayed", left.share / right.share, 1.0,
                    REFERENCE["swapped"], "symmetry")  # fmt: skip
        both, most = 1e3 * (left.place + right.place), 1e3 * REFERENCE["swapped_place"]
        rows.bound(f"{name}: focus, sum of the two mirrored places", both, (-most, most), "symmetry", "mm")
        further = 1e3 * (right.place - before.place)
        rows.bound(f"{name}: focus, further to the later round", further, (0.0, np.inf), _SOURCE, "mm", kind="trend")
        before = right


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
