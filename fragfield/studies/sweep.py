"""Run a case for every combination of values, side by side, into one table.

Of runs with an axisymmetric burst only the rows are kept, without --keep-runs. Others have run directories, as far as
the flight, without report, pictures and files for ParaView; `fragfield run DIR --resume` adds the report to one of
them.

A run that fails is recorded in the table and the others go on. Exit code 0 if all runs are done, 3 if one failed, 2 if
a key or a value is not allowed: then nothing runs.
"""

from __future__ import annotations

import hashlib
import itertools
import json
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, NamedTuple

from rich.console import Console
from rich.table import Table as Lines
from rich.text import Text

from fragfield.case import CaseTable, differences, load_changed_case
from fragfield.case.changes import read_value
from fragfield.case.problem import is_brief
from fragfield.case.write import computed, toml_value
from fragfield.errors import InputError, nearest
from fragfield.files.run_directory import RunDirectory
from fragfield.interface.kinds import Stage, Values
from fragfield.interface.results import Run
from fragfield.interface.results import open as open_run
from fragfield.quantities import column_of, shown
from fragfield.results.part import Part
from fragfield.results.summary import Summary
from fragfield.results.words import not_included_words, whole_metres
from fragfield.studies.study import DONE, FAILED, KEPT, Row, Study, digest_of, exit_code_of_rows, maker
from fragfield.studies.workers import Task

if TYPE_CHECKING:
    from pandas import DataFrame


_STAGES = ("run", "burst")
_EXAMPLE = 'burst.cell_size="8 mm,6 mm"'
_OPENING, _CLOSING, _QUOTES = "[{(", "]})", "\"'"
_LONGEST_NAME = 100  # characters; a file's name may have 255 bytes
_NOT_IN_NAMES = re.compile(r"[^A-Za-z0-9.+-]+")


class SweepResult(Part):
    """What a sweep gives."""

    directory: str
    case_file: str
    stage: str
    keys: tuple[str, ...]
    exit_code: int
    runs: tuple[Row, ...]


@dataclass(repr=False)
class Sweep(Study):
    """A case computed for every combination of values, side by side; a run that fails raises nothing.

    Parameters
    ----------
    values : mapping from key to sequence, or sequence of str
        Values of a key: burst.cell_size="8 mm,6 mm"; in Python `{"burst.cell_size": ["8 mm", "6 mm"]}` as well.
    stage : "run" or "burst"
        The whole chain, or the burst.
    keep_runs : bool
        Keep a run directory of every run.

    Attributes
    ----------
    path : Path
        The folder: sweep.csv, sweep.json, and the run directories that are kept.
    found : SweepResult
        What `fragfield sweep --json` prints, by attribute: `keys`, `exit_code`, and `runs` with `name`, `directory`
        (None where none is kept), `values`, `state` ("done", "kept", "failed" or "waiting"), `message` and `results`.

    Raises
    ------
    InputError
        A key or a value is not allowed, or the folder holds another study.
    """

    name: ClassVar[str] = "sweep"

    values: Values
    stage: Stage = field(default="run", kw_only=True)
    keep_runs: bool = field(default=False, kw_only=True)
    tasks: Sequence[Task] = field(init=False, default=())

    def plan(self) -> None:
        """Resolve the case of every combination."""
        if self.stage not in _STAGES:
            raise InputError(
                f'--stage: found "{self.stage}"{nearest(self.stage, _STAGES)}; allowed: {", ".join(_STAGES)}'
            )
        self.plan_runs(settings_of(self.values))

    def plan_runs(self, settings: Sequence[str]) -> None:
        """Prepare runs and rows for KEY=VALUE[,VALUE...]."""
        self.keys, planned = plan_runs(self.case_file, settings)
        self.tasks, self.rows = zip(*(self.prepared(one) for one in planned), strict=True)

    def prepared(self, planned: Planned) -> tuple[Task, Row]:
        """A run and its row, with a directory where it needs one; raises InputError where another's is there."""
        name, values, case = planned
        directory = RunDirectory(self.path / name)
        kept = self.keep_runs or directory.exists or not is_brief(case)
        if directory.exists and not self.overwrite and (changed := differences(directory.stored_case(), case)):
            hint = "use another --out, or --overwrite to replace such runs. The cases differ in"
            listed = [*changed[:3], *(["..."] if len(changed) > 3 else [])]
            raise InputError("\n  ".join([f"{directory.path}: holds the run of another case; {hint}", *listed]))
        task = Task(
            name, case, self.results_of, values, directory.path if kept else None,
            only="burst" if self.stage == "burst" else None, threads=self.threads,
        )  # fmt: skip
        folder, nothing = str(directory.path) if kept else None, self.results_of(Summary())
        row = Row(name, folder, digest_of(case), values, results=nothing)
        return task, row

    def batches(self) -> Iterator[Sequence[Task]]:
        """All at once."""
        yield self.tasks

    def identity(self) -> dict[str, Any]:
        """Rows of bursts alone are no rows of whole runs."""
        return {"stage": self.stage}

    def result(self) -> Part:
        """The rows."""
        return SweepResult(
            directory=str(self.path), case_file=str(self.case_file), stage=self.stage, keys=tuple(self.keys),
            exit_code=exit_code_of_rows(self.rows), runs=tuple(self.rows),
        )  # fmt: skip

    def csv_rows(self) -> Iterator[list[object]]:
        """One row a run."""
        units = {one.name: one.unit for one in shown("sweep")}
        results = [column_of(name, units.get(name, "")) for name in results_of(Summary())]
        yield ["run", *self.keys, "state", "exit_code", *results, "message"]
        for row in self.rows:
            yield [row.name, *row.values.values(), row.state, row.exit_code, *row.results.values(), row.message]

    def show(self, console: Console) -> None:
        """Print one line a run, and why runs failed."""
        distances = self.stage == "run"
        heads = ["recommended\ndistance m", "expected m", "single\nevents m", "throw m"] if distances else []
        heads += ["mean\nm/s", "99 % of\nmass m/s", "largest\nm/s", "ledger\n%", "lost\ncells", "time s"]
        table = Lines(box=None, pad_edge=False)
        for head in (*labels_of(self.keys).values(), ""):
            table.add_column(Text(head), no_wrap=True)
        for head in heads:
            table.add_column(head, justify="right", no_wrap="m/s" in head or "\n%" in head or "cells" in head)
        for row in self.rows:
            cells = [*map(str, row.values.values()), row.state]
            cells += [*(_distances(row.results) if distances else []), *_numbers(row.results)]
            table.add_row(*map(Text, cells))
        console.print(table)
        if distances:
            console.print(
                "expected ± standard error; single events 5 to 95 % and largest throw are no distances to keep"
            )
            self.show_not_included(console)
        for row in self.rows:
            if row.state == FAILED:
                console.print(f"{row.name} failed (exit code {row.exit_code}): {row.message}")
        console.print(f"written to {self.path}")

    def show_not_included(self, console: Console) -> None:
        """Print which parts the recommended distances leave out."""
        for words in dict.fromkeys(row.results["not_included"] for row in self.rows):
            if words:
                console.print(f"the recommended distances do not include {words}")

    @staticmethod
    def results_of(summary: Summary) -> dict[str, Any]:
        """What a row keeps of a summary, by name in SI; None for what was not computed."""
        return results_of(summary)

    @property
    def runs(self) -> list[Run]:
        """The runs that are done and have a run directory, in the order of the values."""
        return [open_run(row.directory) for row in self.rows if row.state in (DONE, KEPT) and row.directory]

    @property
    def failures(self) -> dict[str, str]:
        """By the name of each run that failed: why."""
        return {row.name: row.message for row in self.rows if row.state == FAILED}

    @property
    def table(self) -> DataFrame:
        """A row a run: its name, the values of the keys, its state, and its results in SI (NaN where there is none)."""
        rows = [{"name": row.name, **row.values, "state": row.state, **row.results} for row in self.rows]
        from pandas import DataFrame

        return DataFrame(rows)

    def __repr__(self) -> str:
        return f"<fragfield.Sweep {str(self.path)!r}: {len(self.rows)} runs, {len(self.failures)} failed>"

    def __str__(self) -> str:
        lines = [f"{len(self.rows)} runs over {', '.join(self.keys)}, in {self.path}"]
        return "\n".join([*lines, *(f"  {name} failed: {message}" for name, message in self.failures.items())])


run_sweep = maker(Sweep)


def results_of(summary: Summary) -> dict[str, Any]:
    """What a sweep lists of a summary, by name in SI, see `fragfield.quantities`; None for what was not computed.

    Beside these `not_included`, parts that the recommended distance does not include, and `wall_seconds` of burst and
    flight together.
    """
    times = [one.wall_seconds for one in (summary.burst, summary.flight) if one is not None]
    return {
        **{one.name: one.of(summary) for one in shown("sweep")},
        "not_included": "" if summary.hazard is None else not_included_words(summary.hazard),
        "wall_seconds": sum(times) if times else None,
    }


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value:.0f}"


def _numbers(results: Mapping[str, Any]) -> list[str]:
    speeds = [_number(results[name]) for name in ("mean_initial_speed", "speed_99", "max_initial_speed")]
    error = results["energy_error"]
    percent = "-" if error is None else f"{100.0 * error:.2f}"
    return [*speeds, percent, _number(results["lost_cells"]), _number(results["wall_seconds"])]


def _distances(results: Mapping[str, Any]) -> list[str]:
    throw = _number(results["largest_throw"])
    if results["determined"] is False:
        return ["not determined", "-", "-", throw]
    distance, error = _number(results["expected_distance"]), results["expected_distance_standard_error"]
    low, high = _number(results["single_event_low"]), _number(results["single_event_high"])
    return [
        whole_metres(results["recommended_distance"], "-"),
        distance if error is None else f"{distance} ± {error:.1f}",
        "-" if low == "-" else f"{low} to {high}",
        throw,
    ]


# --- The plan: every combination of the values as a resolved case


class Planned(NamedTuple):
    """A run: the name of its directory, its values by dotted key, and its case, resolved."""

    name: str
    values: dict[str, Any]
    case: CaseTable


def settings_of(values: Mapping[str, Sequence[Any]] | Sequence[str]) -> list[str]:
    """Values of keys as the command line takes them."""
    if not isinstance(values, Mapping):
        return list(values)
    for key, each in values.items():
        if isinstance(each, str) or not hasattr(each, "__iter__"):
            raise InputError(f"{key}: found {each!r}; needed: a list of its values, such as [{each!r}]")
    return [f"{key}={','.join(toml_value(value) for value in each)}" for key, each in values.items()]


def plan_runs(case_file: Path, settings: Sequence[str]) -> tuple[list[str], list[Planned]]:
    """The keys, and the runs in the order of the values, the last key changing first.

    `settings` are KEY=VALUE[,VALUE...] with dotted keys; commas within quotes or brackets part nothing. Numbers, lists,
    true and false are read as in a case file, all else is a string. Raises InputError: a setting cannot be read, the
    schema knows no such key or allows no such value, or two runs would be alike.
    """
    values = _values(settings)
    labels = labels_of(list(values))
    runs: dict[str, Planned] = {}
    of_case: dict[str, Planned] = {}
    for chosen in itertools.product(*values.values()):
        changes = dict(zip(values, chosen, strict=True))
        name = _name({labels[key]: value for key, value in changes.items()})
        planned = Planned(name, changes, load_changed_case(case_file, changes))
        text = json.dumps(computed(planned.case), sort_keys=True)
        if (other := runs.get(name) or of_case.get(text)) is not None:
            pair = (", ".join(f"{key} = {value}" for key, value in one.values.items()) for one in (other, planned))
            raise InputError(f"the runs {' and '.join(pair)} are alike; give every value once")
        runs[name] = of_case[text] = planned
    return list(values), list(runs.values())


def _values(settings: Sequence[str]) -> dict[str, list[Any]]:
    found: dict[str, list[Any]] = {}
    for setting in settings:
        key, equals, text = (part.strip() for part in setting.partition("="))
        parts = _split(text)
        if not (key and equals) or not all(parts):
            raise InputError(f"found {setting!r}; needed: KEY=VALUE[,VALUE...], for example {_EXAMPLE}")
        if key in found:
            raise InputError(f"{key} is given twice; needed: one list of its values, for example {_EXAMPLE}")
        found[key] = [read_value(part) for part in parts]
    if not found:
        raise InputError(f"no values to sweep over; needed: KEY=VALUE[,VALUE...], for example {_EXAMPLE}")
    return found


def _split(text: str) -> list[str]:
    """Parts of a text between the commas that stand in no quotes and no brackets."""
    parts, depth, quote = [""], 0, ""
    for letter in text:
        if quote:
            quote = "" if letter == quote else quote
        elif letter in _QUOTES:
            quote = letter
        elif letter in _OPENING:
            depth += 1
        elif letter in _CLOSING:
            depth -= 1
        elif letter == "," and depth == 0:
            parts.append("")
            continue
        parts[-1] += letter
    return [part.strip() for part in parts]


def labels_of(keys: Sequence[str]) -> dict[str, str]:
    """Short words for the keys: their last steps where these distinguish them."""
    last = [key.rpartition(".")[2] for key in keys]
    return dict(zip(keys, keys if len(set(last)) < len(keys) else last, strict=True))


def _name(values: Mapping[str, Any]) -> str:
    name = "_".join(_NOT_IN_NAMES.sub("_", f"{label} {value}").strip("_.") for label, value in values.items())
    if len(name) <= _LONGEST_NAME:
        return name
    return f"{name[:_LONGEST_NAME]}_{hashlib.sha256(name.encode()).hexdigest()[:8]}"
