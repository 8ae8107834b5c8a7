"""A study: runs of a case in many variants, made side by side in one folder that keeps what has ended."""

from __future__ import annotations

import hashlib
import inspect
import json
import os
import re
import sys
import time
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import KW_ONLY, asdict, dataclass, field
from functools import wraps
from pathlib import Path
from typing import Any, ClassVar, ParamSpec, Self, TypeVar

from rich.console import Console

from fragfield.case import CaseTable, plain, to_toml
from fragfield.errors import EXIT_DONE, EXIT_NUMERICAL, InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.interface.case import Case
from fragfield.interface.kinds import Address, CaseFile, Count, Folder
from fragfield.pipeline.parallel import launched_size
from fragfield.results.part import Part, to_json
from fragfield.studies.workers import Outcome, Task, make_all, workers_of
from fragfield.terminal.show import plain_console
from fragfield_base.paths import absolute
from fragfield_base.reading import read_text
from fragfield_base.writing import csv_table, described, locked, refuse_link, write_text

Parameters = ParamSpec("Parameters")
Made = TypeVar("Made", bound="Study")
WAITING, DONE, KEPT, FAILED = "waiting", "done", "kept", "failed"
"""States of a run: not yet begun, computed now, kept from before, ended with an error."""
_SAVE_SECONDS = 2.0  # between two writings of the tables
_MOST_JOURNAL = 1 << 31  # bytes


@dataclass
class Row:
    """A run in the tables of a study."""

    name: str
    directory: str | None
    """Its run directory; None where none is kept."""
    case: str
    """Digest of its case."""
    values: dict[str, Any]
    """By dotted key."""
    state: str = WAITING
    exit_code: int | None = None
    message: str = ""
    """Why it failed, or why its distance is not determined."""
    results: dict[str, Any] = field(default_factory=dict)

    def fill(self, outcome: Outcome) -> None:
        """Take over how the run ended; exit code 3 where its distance is not determined."""
        self.exit_code, self.message = outcome.code, outcome.message
        self.state = FAILED if outcome.results is None else DONE
        if outcome.results is not None:
            self.results = outcome.results
            if outcome.results.get("determined") is False:
                self.exit_code = EXIT_NUMERICAL


@dataclass(repr=False)
class Study(ABC):
    """Runs of a case side by side; a subclass says which come next and what follows from their rows.

    Parameters
    ----------
    case : Case or path
        The case file that is varied; a case made in Python is written beside `out` first.
    out : path, optional
        Folder for the study; default runs/NAME_STUDY. A case made in Python needs one.
    threads : int
        Threads of each run.
    jobs : int, optional
        Runs at the same time; default all cores.
    resume : bool
        Continue the study in the folder: keep what has ended.
    overwrite : bool
        Replace the study in the folder.
    scheduler : str, optional
        Run on the workers of this dask scheduler: tcp://node1:8786. The folder must be the same for all of them.
    progress : bool
        Lines on stderr.

    Attributes
    ----------
    path : Path
        The folder, with all results as JSON and a row a run as CSV.
    found
        The results by attribute; `--json` prints them.
    """

    name: ClassVar[str]
    """Names the study and its files."""
    rows_file: ClassVar[str] = ""
    """The table; left out: the name."""
    interim: ClassVar[bool] = True
    """Whether the tables are kept at the state reached."""

    case: CaseFile
    _: KW_ONLY
    out: Folder | None = None
    threads: Count = 1
    jobs: Count | None = None
    resume: bool = False
    overwrite: bool = False
    scheduler: Address | None = None
    progress: bool = True
    path: Path = field(init=False)
    found: Any = field(init=False, default=None)
    rows: Sequence[Row] = field(init=False, default=())
    """All, of runs that wait as well; filled by `plan`."""

    def __post_init__(self) -> None:
        """Settle the folder and the file of the case."""
        out = self.out
        if out is None:
            file = self.case.path if isinstance(self.case, Case) else absolute(self.case, InputError)
            if file is None:
                raise InputError(
                    f'out: missing; a case made in Python needs a folder, such as out="runs/first_{self.name}"'
                )
            out = Path("runs") / f"{file.resolve().stem}_{self.name}"
        self.path = absolute(out, InputError)
        if isinstance(self.case, Case):
            self.case_file = self.path.with_name(f"{self.path.name}.toml")
            self.case_file.parent.mkdir(parents=True, exist_ok=True)
            self.case.write(self.case_file)
        else:
            self.case_file = absolute(self.case, InputError)
        self._journal = Journal(self.path / f"{self.name}.jsonl")

    # --- What a subclass says

    @abstractmethod
    def plan(self) -> None:
        """Read what is asked for and prepare the rows; raises InputError before anything is made."""

    @abstractmethod
    def batches(self) -> Iterator[Sequence[Task]]:
        """The runs that come next, each time after those before have filled their rows."""

    @abstractmethod
    def result(self) -> Part:
        """What follows from the rows, with `exit_code`."""

    @abstractmethod
    def csv_rows(self) -> Iterable[Iterable[object]]:
        """Head and rows of the CSV file."""

    @abstractmethod
    def show(self, console: Console) -> None:
        """Print the result."""

    def identity(self) -> dict[str, Any]:
        """What must be the same for the study to go on."""
        return {}

    # --- What every study does

    def make(self) -> Self:
        """Make the runs that are missing and write the results; what has ended is kept whatever happens."""
        if launched_size() > 1:
            raise InputError("a study starts its own parallel runs; it does not run under mpirun")
        self.plan()
        folder = RunDirectory(self.path)
        folder.make()
        if folder.exists:
            raise InputError(f"{self.path}: holds a run; a {self.name} needs a folder of its own")
        if not self._journal.path.is_file() and (others := sorted(one.name for one in self.path.iterdir())):
            raise InputError(
                f"{self.path}: holds {others[0]}, which is no part of a study; allowed: a new or an empty folder, or "
                "a study's"
            )
        with locked(self.path, InputError):
            self._journal.begin(self.identity(), self.name, resume=self.resume, overwrite=self.overwrite)
            self._refuse_others()
            try:
                self.make_runs()
            finally:
                self._journal.close()
        return self

    def make_runs(self) -> None:
        """Make batch after batch, and write the tables."""
        try:
            for tasks in self.batches():
                self._make_batch(tasks)
        except BaseException:
            if self.interim:
                self.save()
            raise
        self.save()

    def announce(self, task: Task, number: int, of: int) -> None:
        """Say which run begins, before its own warnings."""
        self.say(f"run {number} of {of}: {task.name}")

    def row_ended(self, row: Row) -> None:
        """Follow the rows as they end."""
        del row

    def _make_batch(self, tasks: Sequence[Task]) -> None:
        rows = {row.name: row for row in self.rows}
        numbers = {task.name: number for number, task in enumerate(tasks, start=1)}
        missing = [task for task in tasks if not self._keep(rows[task.name])]
        if not missing:
            return
        saved = time.monotonic()

        def ended(task: Task, outcome: Outcome) -> None:
            nonlocal saved
            rows[task.name].fill(outcome)
            self._journal.add(rows[task.name])
            self.row_ended(rows[task.name])
            if self.interim and time.monotonic() - saved >= _SAVE_SECONDS:
                self.save()
                saved = time.monotonic()

        workers = workers_of(self.scheduler, len(missing), jobs=self.jobs, threads=self.threads)
        begun = lambda task: self.announce(task, numbers[task.name], len(tasks))  # noqa: E731
        make_all(workers, self._claimed(missing, ended), ended, begun)

    def _keep(self, row: Row) -> bool:
        kept = self._journal.rows.get(row.name)
        if kept is None or kept["state"] == FAILED or kept["case"] != row.case:
            return False
        if row.directory is not None and not RunDirectory(Path(row.directory)).exists:
            return False
        row.exit_code, row.message, row.results = kept["exit_code"], kept["message"], kept["results"]
        row.state = KEPT
        return True

    def _claimed(self, tasks: Iterable[Task], ended: Callable[[Task, Outcome], None]) -> Iterator[Task]:
        """The runs with their directories made ready, so that one whose process is killed can go on."""
        for task in tasks:
            if task.directory is not None:
                assert isinstance(task.case, CaseTable)
                try:
                    directory = RunDirectory(task.directory)
                    directory.claim(task.case, resume=self.resume and directory.exists, overwrite=self.overwrite)
                    write_text(task.directory.with_suffix(".toml"), to_toml(task.case), InputError)
                except InputError as error:
                    ended(task, Outcome.of(error))
                    continue
            yield task

    def _refuse_others(self) -> None:
        hint = "of another case; use another --out, or --overwrite to replace such runs"
        for row in self.rows if not self.overwrite else ():
            kept = self._journal.rows.get(row.name)
            if kept is not None and kept["case"] != row.case:
                raise InputError(f"{self._journal.path}: holds the run {row.name} {hint}")

    def save(self) -> None:
        """Write the tables; raises InputError where they cannot be written."""
        self.found = self.result()
        write_text(self.path / f"{self.name}.json", self.text(), InputError)
        write_text(self.path / f"{self.rows_file or self.name}.csv", csv_table(self.csv_rows()), InputError)

    def text(self) -> str:
        """The results as JSON."""
        return json.dumps(to_json(self.found), indent=1, allow_nan=False) + "\n"

    def say(self, words: str) -> None:
        """A line on stderr."""
        if self.progress:
            sys.stderr.write(f"{words}\n")
            sys.stderr.flush()

    @property
    def exit_code(self) -> int:
        """3 where a run failed or its distance is not determined."""
        return int(self.found.exit_code)

    def print(self) -> None:
        """Print the result on stdout."""
        self.show(plain_console(wide=200))


def exit_code_of_rows(rows: Iterable[Row]) -> int:
    """3 where a run failed or its distance is not determined, 0 else."""
    return EXIT_NUMERICAL if any(row.exit_code not in (EXIT_DONE, None) for row in rows) else EXIT_DONE


def digest_of(case: CaseTable) -> str:
    """Names what is computed: all of a resolved case but its title."""
    text = json.dumps({key: value for key, value in plain(case).items() if key != "title"}, sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()[:16]


def maker(study: Callable[Parameters, Made]) -> Callable[Parameters, Made]:
    """The function that makes a study: its parameters and its words are those of the class and of `Study`."""

    @wraps(study, assigned=("__module__",), updated=())
    def run(*arguments: Parameters.args, **options: Parameters.kwargs) -> Made:
        return study(*arguments, **options).make()

    run.__name__ = run.__qualname__ = f"run_{study.name}"  # type: ignore[attr-defined]
    run.__signature__ = inspect.signature(study).replace(return_annotation=study)  # type: ignore[attr-defined]
    shared = re.search(r"^out : .*?(?=\n\n\w+\n-)", inspect.getdoc(Study) or "", re.DOTALL | re.MULTILINE)
    run.__doc__ = (inspect.getdoc(study) or "").replace("\n\nAttributes", f"\n{shared and shared[0]}\n\nAttributes", 1)
    return run


class Journal:
    """The rows of a study that have ended, a line of JSON each, on the disk before the next begins.

    The first line is the identity of the study.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.rows: dict[str, dict[str, Any]] = {}
        self._file: Any = None

    def begin(self, identity: Mapping[str, Any], name: str, *, resume: bool, overwrite: bool) -> None:
        """Open the file, and with `resume` read the rows that have ended.

        Raises InputError: the folder holds a study and neither `resume` nor `overwrite` is asked for, or it is another
        study.
        """
        folder, there = self.path.parent, self.path.is_file()
        if there and not (resume or overwrite):
            raise InputError(
                f"{folder}: holds a study of {name}; allowed: --resume to continue it, --overwrite to compute it "
                "again, or another --out"
            )
        refuse_link(self.path, InputError)
        if there and resume:
            stored, self.rows = self._read()
            now = json.loads(json.dumps(identity))
            if changed := [key for key, value in now.items() if stored.get(key) != value]:
                raise InputError(
                    f"{folder}: --resume continues the same study only; this one differs in {', '.join(changed)}; use "
                    "another --out, or --overwrite to replace it"
                )
        else:
            write_text(self.path, json.dumps(identity) + "\n", InputError)
        try:
            self._file = self.path.open("a", encoding="utf-8")
            if not self.path.read_bytes().endswith(b"\n"):
                self._file.write("\n")  # after a line that was cut off, whose run is made again
        except OSError as error:
            raise InputError(described(self.path, error)) from None

    def add(self, row: Row) -> None:
        """Keep a row: on the disk when this returns."""
        self.rows[row.name] = asdict(row)
        try:
            self._file.write(json.dumps(self.rows[row.name], allow_nan=False) + "\n")
            self._file.flush()
            os.fsync(self._file.fileno())
        except OSError as error:
            raise InputError(described(self.path, error, "runs that have ended are kept")) from None

    def close(self) -> None:
        """Close the file."""
        if self._file is not None:
            self._file.close()

    def _read(self) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Identity, and rows by name; lines that were cut off are left out."""
        stored: dict[str, Any] = {}
        rows = {}
        for number, line in enumerate(read_text(self.path, InputError, most=_MOST_JOURNAL).splitlines()):
            try:
                found = json.loads(line)
                if number == 0:
                    stored = dict(found)
                elif {"name", "case", "state", "exit_code", "message", "results"} <= set(found):
                    rows[found["name"]] = found
            except (ValueError, TypeError):
                continue
        return stored, rows
