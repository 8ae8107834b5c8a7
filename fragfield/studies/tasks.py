"""A run of a study, from a case to its numbers, with a run directory or without any file."""

from __future__ import annotations

import pickle
import tempfile
import time
import warnings
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.case import CaseTable
from fragfield.case.load import case_from_document
from fragfield.errors import EXIT_DONE, EXIT_FAULT, InputError, exit_code_of, message_of
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.recommended import hazard_of, recommended_of
from fragfield.pipeline.convergence import OF_A_SWEEP
from fragfield.pipeline.job import RunOptions
from fragfield.results.break_up import BreakUp
from fragfield.results.convergence import Convergence
from fragfield.results.flight import Flight
from fragfield.results.part import to_json
from fragfield.results.summary import Summary
from fragfield.terminal.logs import to_stderr
from fragfield_base.writing import locked

if TYPE_CHECKING:
    from fragfield.pipeline.beside import Burst

_PATIENCE = 60.0  # s for which a run waits for one that a lost worker has not yet ended in the same directory
_PAUSE = 0.5
_last: dict[object, Burst] = {}
"""The last burst of this process: runs that differ in the break-up or the flight alone have the same."""


@dataclass(frozen=True)
class Task:
    """A run to be made."""

    name: str
    """Of its row, and of its directory in the folder of the study."""
    case: CaseTable | Mapping[str, Any]
    """Resolved; or tables, which are resolved where the run is made."""
    results: Callable[[Summary], dict[str, Any]]
    """What is kept of its summary."""
    values: dict[str, Any] = field(default_factory=dict)
    """By dotted key what distinguishes it."""
    directory: Path | None = None
    """Run directory, which has been claimed: with the same case, what is done in it stays."""
    only: str | None = None
    """"burst", for the burst alone."""
    burst: Path | None = None
    """Run directory of a burst that is shared."""
    sample: bool = False
    """With exposed sites, and fewer points of an integral."""
    threads: int = 1
    scratch: Path | None = None
    """A folder for files of the burst, which are removed; one that is not there: the machine's own."""


@dataclass(frozen=True)
class Outcome:
    """How a run ended."""

    code: int
    """Exit code."""
    message: str = ""
    """Why it failed, or why its distance is not determined."""
    results: dict[str, Any] | None = None

    @classmethod
    def of(cls, error: BaseException) -> Outcome:
        """That of a run which an error ended."""
        return cls(exit_code_of(error), message_of(error))

    @classmethod
    def killed(cls, tries: int) -> Outcome:
        """That of a run which did not outlive its process."""
        return cls(EXIT_FAULT, f"its process was killed {tries} times, for want of memory or by a signal")


def perform(task: Task) -> Outcome:
    """Make a run in this process; what it logs and warns of stands in its run directory alone."""
    try:
        with to_stderr(quiet=True):
            if task.directory is not None:
                return _outcome(task, _in_directory(task, task.directory))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return _outcome(task, _numbers(task))
    except KeyboardInterrupt as error:
        return Outcome.of(error)
    except Exception as error:  # noqa: BLE001 - a failed run is a row of the table
        return Outcome.of(error)


def _outcome(task: Task, summary: Summary) -> Outcome:
    reason = "" if summary.hazard is None or summary.hazard.determined else summary.hazard.reason
    return Outcome(EXIT_DONE, reason, to_json(task.results(summary)))


def _in_directory(task: Task, directory: Path) -> Summary:
    from fragfield.pipeline.chain import run_chain

    _await_lock(directory)
    assert isinstance(task.case, CaseTable)
    options = RunOptions(directory, resume=True, quiet=True, threads=task.threads, lean=True, made=task.case)
    run_chain(options, task.only)
    return RunDirectory(directory).results()


def _await_lock(directory: Path) -> None:
    """Wait while a worker that the scheduler has lost still ends its run there."""
    until = time.monotonic() + _PATIENCE
    while time.monotonic() < until:
        try:
            with locked(directory, InputError, warn=False):
                return
        except InputError:
            time.sleep(_PAUSE)


def _numbers(task: Task) -> Summary:
    from fragfield.pipeline.beside import flown_beside

    case = task.case
    if not isinstance(case, CaseTable):
        case = case_from_document(dict(case), source=task.name, folder=Path())
    summary, snapshot = _burst(case, task)
    if task.only == "burst":
        return Summary(burst=summary)
    if not task.sample:  # no row lists what surfaces and sites meet, and their crossings take a third of the flight
        case = case.model_copy(update={"witness": [], "exposed": []})
    began = time.perf_counter()
    flown, fragments = flown_beside(case, snapshot, task.threads, sample=task.sample)
    hazard = hazard_of(flown.hazard.headline)
    return Summary(
        burst=summary,
        break_up=BreakUp.known(fragments=fragments),
        flight=Flight.known(wall_seconds=time.perf_counter() - began),
        hazard=hazard if task.sample else recommended_of(hazard, Convergence(reason=OF_A_SWEEP)),
        exposed=tuple(flown.exposed),
    )


def _burst(case: CaseTable, task: Task) -> Burst:
    """The burst's summary, and the state at its end: of a run directory, of the last run, or of one made now."""
    from fragfield.case.conversion.rounds import burst_rounds
    from fragfield.case.problem import burst_settings
    from fragfield.pipeline.beside import burst_beside
    from fragfield.pipeline.parallel import Team
    from transition import Snapshot

    key: object = task.burst or pickle.dumps((burst_rounds(case), burst_settings(case)))
    if key not in _last:
        _last.clear()  # before the next one is made: two of them may not fit into the memory
        if task.burst is not None:
            run = RunDirectory(task.burst)
            burst = run.results().burst
            assert burst is not None  # a run that is shared
            _last[key] = burst, Snapshot.read(run.file("burst_snapshot.h5"))
        else:
            scratch = task.scratch if task.scratch is not None and task.scratch.is_dir() else None
            _last[key] = burst_beside(case, Path(tempfile.mkdtemp(prefix="burst-", dir=scratch)), Team())
    return _last[key]
