"""Find the largest number of rounds for which a case still meets its criteria.

Every exposed site must meet its criterion, and with --distance the distance to apply for storage and handling (the
largest of the recommended, the official and the prescribed ones) must not exceed it. The smallest and the largest
number are computed first, then the interval is halved; each run has a folder of its own.

Exit code 3 where a run failed or has no distance, which counts as not met; 2 if a key or a value is not allowed: then
nothing runs.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from itertools import pairwise
from math import hypot
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar

from rich.console import Console
from rich.table import Table as Lines
from rich.text import Text

from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.contents import with_images
from fragfield.interface.kinds import Every, Length, Steps
from fragfield.results.part import Part, out
from fragfield.results.rules import DistanceOfUse
from fragfield.results.summary import Summary
from fragfield.results.words import metres, whole_metres
from fragfield.studies.study import DONE, FAILED, KEPT, Row, exit_code_of_rows, maker
from fragfield.studies.sweep import Planned, Sweep, settings_of
from fragfield.studies.workers import Task
from fragfield_base.inputs import NotAllowedError, Quantity

if TYPE_CHECKING:
    from pandas import DataFrame


_DISTANCE = Quantity("m", "300 m", above=0.0)
_SIGNIFICANT = 2.0  # standard errors of a difference
_MOST_VALUES = 200
_RANGE = re.compile(r"(?P<low>\d+)\s*\.\.\s*(?P<high>\d+)")
_EXAMPLE = 'stack.count=1..20, or stack.counts="[1,1,1],[2,1,1],[2,2,1]"'
_COLUMNS = {
    "rounds": "rounds", "explosive": "net_explosive_quantity_kg", "recommended": "recommended_m",
    "standard_error": "standard_error_m", "to_apply": "to_apply_m", "met": "met", "state": "state",
    "exit_code": "exit_code",
}  # fmt: skip


@dataclass
class LimitRow(Row):
    """A number of rounds, and whether it meets the criteria."""

    rounds: int = 0
    met: bool | None = None
    """None before it is computed; a run that failed or whose distance is not determined does not meet them."""
    explosive: float | None = None
    """kg; None where it is not known."""
    to_apply: float | None = None
    """m: for storage and handling, the largest of the recommended, the official and the prescribed distances."""
    recommended: float | None = None
    """m; None where it is not determined."""
    standard_error: float | None = None
    """m."""
    not_met: list[str] = field(default_factory=list)
    """Names of exposed sites."""
    reasons: list[str] = field(default_factory=list)
    """Why the criteria are not met."""


class Reached(Part):
    """A number of rounds; kg, m."""

    value: Any = out("Of the key")
    rounds: int
    explosive: float | None = out("Net explosive quantity", "kg")
    recommended: float | None = out("Recommended distance", "m")
    run: str | None = out("Its run directory")


class LimitResult(Part):
    """What a limit gives."""

    directory: str
    case_file: str
    key: str
    criteria: str
    limit: Reached | None = out("None where not even the smallest number meets the criteria")
    first_not_met: Reached | None = out("None where all meet them")
    words: tuple[str, ...]
    exit_code: int
    runs: tuple[LimitRow, ...]


@dataclass(repr=False)
class Limit(Sweep):
    """The largest number of rounds for which a case still meets its criteria.

    Parameters
    ----------
    values : mapping from one key to a range or sequence, or str
        Values of a key by which the number of rounds rises: stack.count=1..20; in Python
        `{"stack.count": range(1, 21)}` or `{"stack.counts": [[1, 1, 1], [2, 1, 1]]}` as well.
    distance : str, optional
        Distance that is not to be exceeded, such as "300 m".
    every : bool
        Compute every number of rounds, not by bisection.

    Attributes
    ----------
    path : Path
        The folder: a run directory for each run, limit.csv and limit.json.
    found : LimitResult
        What `fragfield limit --json` prints, by attribute: `key`, `criteria`, `limit` and `first_not_met` (value,
        rounds, explosive, recommended, run), `words`, `exit_code` and `runs`: those computed, as in a sweep, with
        `rounds`, `met`, quantities and `reasons`.

    Raises
    ------
    InputError
        A key or a value is not allowed, there is nothing to meet, or the folder holds another study.
    """

    name: ClassVar[str] = "limit"

    values: Steps
    distance: Length | None = field(default=None, kw_only=True)
    every: Every = field(default=False, kw_only=True)
    stage: str = field(default="run", init=False)
    keep_runs: bool = field(default=True, init=False)  # each is judged by all of its summary
    rows: Sequence[LimitRow] = field(init=False, default=())

    def plan(self) -> None:
        """Resolve the cases; raises InputError where the number of rounds does not rise, or nothing is to be met."""
        self._limit = None
        if self.distance is not None:
            try:
                self._limit = float(_DISTANCE.parse(self.distance))
            except NotAllowedError as error:
                raise InputError(f"--distance: {error}") from None
        setting = self.values
        if not isinstance(setting, str):
            if len(setting) != 1:
                words = f"found {len(setting)} keys; allowed: one, such as {{'stack.count': range(1, 21)}}"
                raise InputError(f"values: {words}")
            (setting,) = settings_of(setting)
        self.plan_runs([listed_values(setting)])
        self.key = self.keys[0]
        if len(self.rows) < 2:
            raise InputError(f"found {setting!r}, a single value; needed: two or more, for example {_EXAMPLE}")
        for before, after in pairwise(self.rows):
            if not after.rounds > before.rounds:
                raise InputError(
                    f"{self.key} = {before.values[self.key]} makes {_rounds(before.rounds)}, {self.key} = "
                    f"{after.values[self.key]} makes {_rounds(after.rounds)}; needed: values whose number of rounds "
                    f"rises, for example {_EXAMPLE}"
                )
        if self._limit is None and not self._exposed:
            raise InputError(
                "nothing to meet: the case has no exposed sites and no distance is asked for; needed: at least one "
                'table [[exposed]], or --distance "300 m"'
            )

    def prepared(self, planned: Planned) -> tuple[Task, LimitRow]:
        """A run, and its row with the number of rounds."""
        task, row = super().prepared(planned)
        self._exposed = bool(planned.case.exposed)
        rounds = len(with_images(planned.case)) if planned.case.round else 0
        return task, LimitRow(**vars(row), rounds=rounds)

    def batches(self) -> Iterator[Sequence[Task]]:
        """The smallest and the largest number, then the middle of those between met and not met."""
        rows, low, high = self.rows, 0, len(self.rows) - 1
        yield self.tasks if self.every else (self.tasks[low], self.tasks[high])
        self._judge()
        while not self.every and rows[0].met and not rows[-1].met and high - low > 1:
            middle = (low + high) // 2
            yield [self.tasks[middle]]
            self._judge()
            low, high = (middle, high) if rows[middle].met else (low, middle)

    def _judge(self) -> None:
        for row in self.rows:
            if row.state == FAILED:
                row.met, row.reasons = False, [f"the run failed: {row.message}"]
            elif row.directory is not None and row.state in (DONE, KEPT):
                judge(row, RunDirectory(Path(row.directory)).results(), self._limit, exposed=self._exposed)

    def result(self) -> Part:
        """The limit, with sentences, and the rows computed."""
        rows = self.computed
        limit, first_not_met, words = limit_of(rows, asked=[row.rounds for row in self.rows])
        return LimitResult(
            directory=str(self.path), case_file=str(self.case_file), key=self.key, criteria=self.criteria,
            limit=self._named(limit), first_not_met=self._named(first_not_met), words=tuple(words),
            exit_code=exit_code_of_rows(rows), runs=tuple(rows),
        )  # fmt: skip

    @property
    def computed(self) -> list[LimitRow]:
        """The rows that were computed."""
        return [row for row in self.rows if row.met is not None]

    @property
    def criteria(self) -> str:
        """What is to be met, in words."""
        parts = ["the criterion of every exposed site is met"] if self._exposed else []
        if self._limit is not None:
            parts.append(f"the distance to apply for storage and handling is at most {metres(self._limit)}")
        return " and ".join(parts)

    def _named(self, row: LimitRow | None) -> Reached | None:
        if row is None:
            return None
        return Reached(
            value=row.values[self.key], rounds=row.rounds, explosive=row.explosive, recommended=row.recommended,
            run=row.directory,
        )  # fmt: skip

    def csv_rows(self) -> Iterator[list[object]]:
        """One row a run computed."""
        yield ["run", self.key, *_COLUMNS.values(), "reasons"]
        for row in self.computed:
            cells = (getattr(row, name) for name in _COLUMNS)
            yield [row.name, str(row.values[self.key]), *cells, "; ".join(row.reasons)]

    def show(self, console: Console) -> None:
        """Print one line a run computed, the limit, and what is to be known of it."""
        table = Lines(box=None, pad_edge=False)
        for head in (self.key, "rounds", "net explosive kg", "recommended m", "to apply m", "", "criteria", ""):
            table.add_column(Text(head), justify="right" if head not in ("", "criteria") else "left", no_wrap=True)
        for row in self.computed:
            cells = [str(row.values[self.key]), str(row.rounds)]
            cells += ["-" if row.explosive is None else f"{row.explosive:.4g}"]
            cells += [whole_metres(row.recommended, "-"), whole_metres(row.to_apply, "-"), row.state]
            table.add_row(*map(Text, [*cells, "met" if row.met else "not met", "; ".join(row.reasons)]))
        console.print(table)
        console.print("recommended: the computed distance; to apply: for storage and handling, by whatever is largest")
        self.show_not_included(console)
        for words in (*self._words(), f"written to {self.path}"):
            console.print(words)

    def _words(self) -> list[str]:
        limit = self.found.limit
        if limit is None:
            return [f"limit: none, so that {self.criteria}", *self.remarks]
        quantity = "" if limit.explosive is None else f", net explosive quantity {limit.explosive:.3g} kg"
        where = f"{_rounds(self.rounds)} ({self.key} = {limit.value}{quantity})"
        return [f"limit: {where}, so that {self.criteria}", *self.remarks]

    @property
    def rounds(self) -> int:
        """Largest number of rounds up to which all that was computed meets the criteria; 0 where none does."""
        return 0 if self.found.limit is None else int(self.found.limit.rounds)

    @property
    def explosive(self) -> float:
        """Net explosive quantity (kg) at the limit; 0 where not even the smallest is allowed."""
        return 0.0 if self.found.limit is None else float(self.found.limit.explosive)

    @property
    def remarks(self) -> list[str]:
        """What is to be known of the limit: gaps, quantities that do not rise, larger prescribed distances."""
        return list(self.found.words)

    @property
    def table(self) -> DataFrame:
        """A row a run computed: value, rounds, net explosive quantity (kg), distances (m), `met` and reasons."""
        names = ("rounds", "explosive", "recommended", "standard_error", "to_apply")
        rows = [
            {self.key: str(row.values[self.key]), **{name: getattr(row, name) for name in names},
             "met": "yes" if row.met else "no", "reasons": "; ".join(row.reasons)}
            for row in self.computed
        ]  # fmt: skip
        from pandas import DataFrame

        return DataFrame(rows)

    def __repr__(self) -> str:
        return f"<fragfield.Limit {str(self.path)!r}: {self.rounds} rounds, {len(self.computed)} runs>"

    def __str__(self) -> str:
        return "\n  ".join(self._words())


run_limit = maker(Limit)


def judge(row: LimitRow, summary: Summary, limit: float | None, *, exposed: bool) -> None:
    """Fill a row with the run's quantities, and whether it meets a distance (m) and the criteria of exposed sites.

    A rule that is left out for its range counts by its formula.
    """
    hazard, to_apply, rules = summary.hazard, summary.distance_to_apply, summary.rules
    siting = to_apply.siting if to_apply else DistanceOfUse(distance=None, by=None, left_out=())
    row.explosive = rules.contents.explosive if rules and rules.contents else None
    row.to_apply, row.recommended = siting.distance, hazard.recommended if hazard else None
    row.standard_error = hazard.standard_error if hazard else None
    sites = [entry for entry in summary.exposed or () if entry.verdict != "met"] if exposed else []
    row.not_met = [entry.name for entry in sites]
    row.reasons = [f"{entry.name}: {entry.verdict}" for entry in sites]
    if row.recommended is None:
        row.reasons.append("the distance is not determined")
    if limit is not None:
        if siting.distance is not None and siting.distance > limit:
            row.reasons.append(f"{metres(siting.distance)} by {siting.by}")
        row.reasons += [
            f"{metres(one.distance)} by the formula of “{one.name}”, which does not apply because {one.reason}"
            for one in siting.left_out
            if one.missing and one.distance is not None and one.distance > limit
        ]
    row.met = not row.reasons


def limit_of(rows: Sequence[LimitRow], asked: Sequence[int]) -> tuple[LimitRow | None, LimitRow | None, list[str]]:
    """The largest number up to which every computed one meets the criteria, the first that does not, and sentences.

    `rows` in the order of their rounds; `asked`: all numbers of rounds that were asked for.
    """
    first_not_met = next((row for row in rows if not row.met), None)
    met = rows if first_not_met is None else rows[: rows.index(first_not_met)]
    limit = met[-1] if met else None
    if limit is None:
        return None, first_not_met, [f"Not even the smallest number, {asked[0]}, meets the criteria.", *_falls(rows)]
    words = []
    if first_not_met is None:
        words.append(f"The largest number asked for, {asked[-1]}, meets the criteria; more may do so too.")
    elif first_not_met.rounds > limit.rounds + 1:
        known = not any(limit.rounds < number < first_not_met.rounds for number in asked)
        between = f"between {limit.rounds} and {first_not_met.rounds} rounds"
        words.append(f"Nothing {between} was {'asked for' if known else 'computed'}.")
    computed = {row.rounds for row in rows}
    if left_out := [number for number in asked if number < limit.rounds and number not in computed]:
        listed = ", ".join(map(str, left_out))
        if len(left_out) > 6:
            listed = f"{left_out[0]} to {left_out[-1]}, {len(left_out)} of them"
        words.append(
            f"Not computed, and taken to meet the criteria since a larger number does: {listed} rounds (--all computes "
            "every one)."
        )
    words += _falls(rows)
    if limit.to_apply is not None and limit.recommended is not None and limit.to_apply > limit.recommended:
        words.append(
            f"At the limit the distance to apply for storage and handling is {metres(limit.to_apply)}, more "
            f"than the recommended {metres(limit.recommended)}."
        )
    return limit, first_not_met, words


def _falls(rows: Sequence[LimitRow]) -> Iterator[str]:
    """Where more rounds have a smaller distance, or meet what fewer do not; bisection rests on neither happening."""
    for fewer, more in pairwise(row for row in rows if row.recommended is not None):
        assert fewer.recommended is not None
        assert more.recommended is not None
        drop = fewer.recommended - more.recommended
        if drop > 0.0:
            error = hypot(fewer.standard_error or 0.0, more.standard_error or 0.0)
            how = "within the statistical error" if drop <= _SIGNIFICANT * error else "beyond the statistical error"
            yield (
                f"Not monotonic: {more.rounds} rounds have a recommended distance of {metres(more.recommended)}, "
                f"{fewer.rounds} have {metres(fewer.recommended)} ({how})."
            )
    for fewer, more in pairwise(rows):
        if more.met and not fewer.met:
            yield (
                f"Not monotonic: {more.rounds} rounds meet the criteria, {fewer.rounds} do not; the limit is below the "
                "smallest that does not."
            )


def _rounds(number: int) -> str:
    return f"{number} round{'' if number == 1 else 's'}"


def listed_values(setting: str) -> str:
    """The setting with a range written as the list of its numbers."""
    key, equals, text = (part.strip() for part in setting.partition("="))
    if not (key and equals and text):
        raise InputError(f"found {setting!r}; needed: KEY=LOW..HIGH or KEY=VALUE,VALUE,..., for example {_EXAMPLE}")
    match = _RANGE.fullmatch(text.strip("\"'"))
    if match is None:
        if ".." in text:
            raise InputError(f"found {setting!r}; needed: whole numbers, for example {_EXAMPLE}")
        return setting
    low, high = int(match["low"]), int(match["high"])
    if not low < high:
        raise InputError(f"found {setting!r}; needed: a range that rises, for example {_EXAMPLE}")
    if high - low >= _MOST_VALUES:
        raise InputError(f"found {setting!r}, {high - low + 1} values; allowed: at most {_MOST_VALUES}")
    return f"{key}={','.join(str(number) for number in range(low, high + 1))}"
