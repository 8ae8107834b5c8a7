"""Trends of stacks from their runs to their rows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from validation.runs import ROOT, STOPPED, StudyError, summary_of
from validation.soundness import sound, void_where_unsound
from validation.stack_trends.check import (
    NAME,
    REFERENCE,
    Focus,
    count_rows,
    delay_rows,
    end_row,
    focus_of,
    gap_rows,
    speed_row,
    varied,
)

if TYPE_CHECKING:
    from collections.abc import Sequence

    from validation.options import Options
    from validation.rows import Row
    from validation.runs import Runs

__all__ = ["study"]

_GAP = 0.0217  # m, of the pair in the paper


@dataclass
class _Stacks:
    """Runs of the case with other numbers of rounds, gaps and delays, and the rows of those that are not sound."""

    runs: Runs
    size: str
    unsound: list[Row] = field(default_factory=list)

    def summary(self, name: str, *, count: int = 2, gap: float = _GAP, delays: Sequence[float] = ()) -> dict[str, Any]:
        """Run one and return its summary with the folder; a row is added for what is not sound."""
        times = list(delays) or [0.0] * count
        text = (ROOT / REFERENCE["case"]).read_text(encoding="utf-8")
        self.runs.folder.mkdir(parents=True, exist_ok=True)
        path = self.runs.folder / f"{NAME}_{name}.toml"
        end = REFERENCE["end"] + max(times)
        path.write_text(varied(text, count=count, gap=gap, delays=times, end=end), encoding="utf-8")
        folder = self.runs.run(f"{NAME}_{name}", str(path), self.size, stage="burst")
        found = summary_of(folder)
        self.unsound += [row for row in sound(NAME, found, REFERENCE["sound"], name) if row.passed is False]
        return {**found, "folder": folder}

    def focus(self, name: str, **changes: Any) -> Focus:
        """The focus of one."""
        return focus_of(self.summary(name, **changes)["folder"] / "burst_snapshot.h5")

    def focus_or_stop(self, name: str, delays: Sequence[float]) -> Focus | None:
        """The focus of a pair with delays (s); None where its burst was stopped for its numbers."""
        try:
            return self.focus(name, delays=delays)
        except StudyError as error:
            if error.code != STOPPED:
                raise
            return None


def study(options: Options, runs: Runs, rows: list[Row]) -> None:
    """Burst single round, pairs over gaps and delays, and longer rows."""
    quick = "quick_" if options.quick else ""
    stacks = _Stacks(runs, options.cell_size or REFERENCE[f"{quick}size"])
    with void_where_unsound(stacks.unsound, rows):
        _compare(stacks, quick, rows)


def _compare(stacks: _Stacks, quick: str, rows: list[Row]) -> None:
    """Add the rows of each kind of stacks as soon as these have burst."""
    alone = stacks.summary("single", count=1)
    single = focus_of(alone["folder"] / "burst_snapshot.h5")
    calibre = REFERENCE["calibre"]
    gaps = {
        gap: stacks.focus(f"gap_{gap:g}", gap=_GAP if gap == REFERENCE["gaps"][0] else gap * calibre)
        for gap in REFERENCE[f"{quick}gaps"]
    }
    pair = gaps[REFERENCE["gaps"][0]]
    rows += gap_rows(gaps, single)
    rows.append(speed_row(pair, float(alone["burst"]["max_initial_speed"])))
    counts = {count: pair if count == 2 else stacks.focus(f"row_{count}", count=count) for count in REFERENCE["counts"]}
    rows += count_rows(counts)
    delays = {}
    for delay in REFERENCE[f"{quick}delays"]:
        swapped = {"left": (delay, 0.0), "right": (0.0, delay)}
        found = [stacks.focus_or_stop(f"{side}_{1e6 * delay:g}_us", times) for side, times in swapped.items()]
        rows.append(end_row(delay, found))
        if None not in found:
            delays[delay] = (found[0], found[1])
    rows += delay_rows(delays, pair)
