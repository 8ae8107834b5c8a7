"""A sweep's runs, one after another, each by the command line in a process of its own.

A process of its own gives each run its own peak of memory, and a run that ends badly takes no other with it.
"""

from __future__ import annotations

import json
import subprocess
import sys
from contextlib import suppress
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from fragfield.case import differences, to_toml
from fragfield.errors import EXIT_DONE, EXIT_FAULT, EXIT_INTERRUPTED, EXIT_NUMERICAL, InputError, nearest
from fragfield.parallel import launched_size
from fragfield.run_directory import STAGES, RunDirectory
from fragfield.sweep.results import DONE, FAILED, KEPT, WAITING, results_of, write_tables
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.sweep.plan import PlannedRun, SweepPlan

__all__ = ["SweepOptions", "run_sweep"]

_STAGES = ("run", "burst")


@dataclass(frozen=True)
class SweepOptions:
    """How the runs are made.

    Attributes
    ----------
    folder : Path
        Holds one run directory a run, and the tables.
    stage : "run" or "burst"
        The whole chain to the report, or the burst alone.
    threads : int, optional
        Threads of a run.
    resume : bool
        Keep finished runs and go on with begun ones.
    overwrite : bool
        Replace runs of other cases in the same directories.
    quiet : bool
        No progress.
    """

    folder: Path
    stage: str = "run"
    threads: int | None = None
    resume: bool = False
    overwrite: bool = False
    quiet: bool = False

    def __post_init__(self) -> None:
        """Refuse stages that begin with files of another run."""
        if self.stage not in _STAGES:
            hint = nearest(self.stage, _STAGES)
            raise InputError(f'--stage: found "{self.stage}"{hint}; allowed: {", ".join(_STAGES)}')


def run_sweep(plan: SweepPlan, options: SweepOptions) -> dict[str, Any]:
    """Run what is planned and keep sweep.json and sweep.csv at the state reached.

    Returns
    -------
    dict
        `directory`, `case_file`, `stage`, `keys`, `exit_code` (0, or 3 where a run failed) and `runs`: for each its
        `name`, `directory`, `values`, `state` ("done", "kept", "failed" or "waiting"), `exit_code`, `message` and
        `results`, see `fragfield.sweep.results`.

    Raises
    ------
    InputError
        A directory holds another case's run and `overwrite` is not asked for, or cannot be written.
    """
    if launched_size() > 1:
        raise InputError("sweep starts its runs itself, one after another; it does not run under mpirun")
    _check_directories(plan, options)
    rows = [_row(planned, options) for planned in plan.runs]
    found = {
        "directory": str(options.folder), "case_file": str(plan.case_file), "stage": options.stage,
        "keys": list(plan.keys), "exit_code": EXIT_DONE, "runs": rows,
    }  # fmt: skip
    for number, (planned, row) in enumerate(zip(plan.runs, rows, strict=True), start=1):
        _tell(f"run {number} of {len(rows)}: {planned.name}", options)
        _perform(planned, row, options)
        if row["exit_code"] not in (EXIT_DONE, None):
            found["exit_code"] = EXIT_NUMERICAL
        write_tables(found, options.folder)
    return found


def _check_directories(plan: SweepPlan, options: SweepOptions) -> None:
    """Refuse before the first run what would be refused at the last one."""
    folder = RunDirectory(options.folder)
    folder.make()
    if folder.exists:
        raise InputError(f"{options.folder}: holds a run; a sweep needs a folder of its own")
    if options.overwrite:
        return
    for planned in plan.runs:
        directory = _directory(planned, options)
        if directory.exists and (changed := differences(directory.stored_case(), planned.case)):
            hint = "use another --out, or --overwrite to replace such runs. The cases differ in"
            shown = [*changed[:3], *(["..."] if len(changed) > 3 else [])]
            raise InputError("\n  ".join([f"{directory.path}: holds the run of another case; {hint}", *shown]))


def _directory(planned: PlannedRun, options: SweepOptions) -> RunDirectory:
    return RunDirectory(options.folder / planned.name)


def _row(planned: PlannedRun, options: SweepOptions) -> dict[str, Any]:
    """What the table says of a run before it begins."""
    return {
        "name": planned.name, "directory": str(_directory(planned, options).path), "values": planned.values,
        "state": WAITING, "exit_code": None, "message": "", "results": results_of({}),
    }  # fmt: skip


def _perform(planned: PlannedRun, row: dict[str, Any], options: SweepOptions) -> None:
    """Make one run, unless it is finished, and fill its row."""
    directory = _directory(planned, options)
    same = directory.exists and not differences(directory.stored_case(), planned.case)
    if options.resume and same and _finished(directory, options.stage):
        _fill(row, KEPT, directory)
        return
    case_file = options.folder / f"{planned.name}.toml"
    write_text(case_file, to_toml(planned.case), InputError)
    command = [sys.executable, "-m", "fragfield", options.stage, str(case_file), "--out", str(directory.path), "--json"]
    command += ["--threads", str(options.threads)] if options.threads else []
    command += ["--quiet"] if options.quiet else []
    command += ["--resume"] if options.resume and same else ["--overwrite"] if options.overwrite else []
    code, printed = _call(command)
    if code == EXIT_INTERRUPTED:
        raise KeyboardInterrupt
    open_ = results_of(directory.summary())["determined"] is False  # all output is written
    if code == EXIT_DONE or (code == EXIT_NUMERICAL and open_):
        _fill(row, DONE, directory)
    else:
        row.update(state=FAILED, exit_code=code, message=_message(code, printed))


def _fill(row: dict[str, Any], state: str, directory: RunDirectory) -> None:
    """Fill the row of a finished run; one whose hazard distance is not determined has the exit code and reason."""
    summary = directory.summary()
    results = results_of(summary)
    known = results["determined"] is not False
    message = "" if known else str(summary["hazard"]["reason"])
    row.update(state=state, exit_code=EXIT_DONE if known else EXIT_NUMERICAL, results=results, message=message)


def _finished(directory: RunDirectory, stage: str) -> bool:
    return all(directory.complete(one) for one in STAGES.values() if stage == "run" or one.name == stage)


def _call(command: list[str]) -> tuple[int, str]:
    """Exit code and stdout of a command; an interruption is passed on once and waited for.

    The command has a session of its own, so that Ctrl-C reaches it by us alone: a second signal would break the
    checkpoint that the first one makes it write.
    """
    process = subprocess.Popen(command, stdout=subprocess.PIPE, text=True, start_new_session=True)
    try:
        printed, _ = process.communicate()
    except KeyboardInterrupt:
        process.terminate()
        process.communicate()
        raise
    return process.returncode, printed


def _message(code: int, printed: str) -> str:
    """Why a run failed, in the words of its last line on stdout."""
    with suppress(IndexError, KeyError, TypeError, ValueError):
        return str(json.loads(printed.splitlines()[-1])["error"]["message"])
    if code < 0:
        return f"ended by signal {-code}"
    return "a fault of the program; its traceback is in the run's log" if code == EXIT_FAULT else f"exit code {code}"


def _tell(text: str, options: SweepOptions) -> None:
    """Name the run on stderr, before its own warnings."""
    if not options.quiet:
        sys.stderr.write(f"{text}\n")
        sys.stderr.flush()
