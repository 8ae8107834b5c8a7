"""Runs a sweep in parallel processes, each on one thread unless set otherwise.

Of a run that takes seconds, with a burst in its meridian, the row of the table is kept and no file. A run in three
dimensions, or with `keep_runs` every one, has a run directory, from which an interrupted one goes on: burst, break-up
and flight without report, pictures and files for ParaView; `fragfield run CASE --out DIR --resume` adds the report.
"""

from __future__ import annotations

import json
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.case import differences, to_toml
from fragfield.case.problem import is_brief
from fragfield.errors import EXIT_DONE, EXIT_INTERRUPTED, EXIT_NUMERICAL, InputError, exit_code_of, message_of, nearest
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield.pipeline.parallel import launched_size
from fragfield.studies.runner import make_all, runs_of
from fragfield.studies.sweep.results import DONE, FAILED, KEPT, WAITING, results_of, write_tables
from fragfield.studies.sweep.row import digest_of, stored_rows
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Callable

    from fragfield.studies.runner import Runs
    from fragfield.studies.sweep.plan import PlannedRun, SweepPlan


_STAGES = ("run", "burst")
_PATIENCE = 60.0  # s for which a run on a cluster waits for one that a lost worker has not yet ended
_TABLE_SECONDS = 2.0  # between two writings of the tables


@dataclass(frozen=True)
class SweepOptions:
    """How the runs are made."""

    folder: Path
    """Holds the tables, and the run directories that are kept."""
    stage: str = "run"
    """"run" or "burst": burst, break-up and flight, or the burst alone."""
    threads: int | None = None
    """Threads of a run; left out: one."""
    resume: bool = False
    """Keep finished runs and continue unfinished ones."""
    overwrite: bool = False
    """Replace runs of other cases in the same directories."""
    quiet: bool = False
    """No progress."""
    jobs: int | None = None
    """Runs side by side; left out: as many as the cores that this process may use hold."""
    scheduler: str | None = None
    """Address of a dask scheduler, whose workers make the runs; `folder` must be the same folder for all of them where
    run directories are kept."""
    keep_runs: bool = False
    """Keep a run directory of every run."""

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
        `name`, `directory` (None where none is kept), `case` (a digest), `values`, `state` ("done", "kept", "failed" or
        "waiting"), `exit_code`, `message` and `results`, see `fragfield.studies.sweep.results`.

    Raises
    ------
    InputError
        A directory holds another case's run and `overwrite` is not asked for, or cannot be written.
    """
    check_directories(plan, options)
    rows = [planned_row(planned, options) for planned in plan.runs]
    found = {
        "directory": str(options.folder), "case_file": str(plan.case_file), "stage": options.stage,
        "keys": list(plan.keys), "exit_code": EXIT_DONE, "runs": rows,
    }  # fmt: skip
    try:
        make_runs(plan, rows, options, lambda: write_tables(found, options.folder))
    finally:
        if any(row["exit_code"] not in (EXIT_DONE, None) for row in rows):
            found["exit_code"] = EXIT_NUMERICAL
        write_tables(found, options.folder)
    return found


def make_runs(
    plan: SweepPlan, rows: list[dict[str, Any]], options: SweepOptions, save: Callable[[], None] = lambda: None
) -> None:
    """Make the runs side by side, fill their rows, and save the tables from time to time."""
    saved = time.monotonic()
    stored = stored_rows(_table(options)) if options.resume else {}
    runs = runs_of(options.scheduler, len(rows), jobs=options.jobs, threads=options.threads or 1)

    def make(number: int) -> tuple[str, int, str]:
        planned, row = plan.runs[number], rows[number]
        _report(f"run {number + 1} of {len(rows)}: {planned.name}", options)
        if row["directory"] is not None:
            return _perform(planned, runs, options)
        before = stored.get(row["name"])
        if before is not None and before["case"] == row["case"]:
            return KEPT, EXIT_DONE, json.dumps({key: before[key] for key in ("results", "message")})
        return _outcome(*runs.call({"stage": "row", "case": planned.case, "of": options.stage}))

    def ended(number: int, outcome: tuple[str, int, str]) -> None:
        nonlocal saved
        _fill(rows[number], outcome)
        if time.monotonic() - saved >= _TABLE_SECONDS:
            save()
            saved = time.monotonic()

    make_all(runs, range(len(rows)), make, ended)


def check_directories(plan: SweepPlan, options: SweepOptions) -> None:
    """Refuse before the first run what would be refused at the last one.

    Raises InputError: this is a rank of several, or a directory or a row is that of another case's run and `overwrite`
    is not asked for.
    """
    if launched_size() > 1:
        raise InputError("a study starts its own parallel runs; it does not run under mpirun")
    folder = RunDirectory(options.folder)
    folder.make()
    if folder.exists:
        raise InputError(f"{options.folder}: holds a run; a sweep needs a folder of its own")
    if options.overwrite:
        return
    stored = stored_rows(_table(options))
    for planned in plan.runs:
        directory = _directory(planned, options)
        if directory.exists and (changed := differences(directory.stored_case(), planned.case)):
            hint = "use another --out, or --overwrite to replace such runs. The cases differ in"
            shown = [*changed[:3], *(["..."] if len(changed) > 3 else [])]
            raise InputError("\n  ".join([f"{directory.path}: holds the run of another case; {hint}", *shown]))
        if planned.name in stored and stored[planned.name]["case"] != digest_of(planned.case):
            raise InputError(
                f"{_table(options)}: holds the run {planned.name} of another case; use another --out, or --overwrite "
                "to replace such runs"
            )


def _table(options: SweepOptions) -> Path:
    return options.folder / "sweep.json"


def _directory(planned: PlannedRun, options: SweepOptions) -> RunDirectory:
    return RunDirectory(options.folder / planned.name)


def planned_row(planned: PlannedRun, options: SweepOptions) -> dict[str, Any]:
    """What the table says of a run before it begins."""
    directory = _directory(planned, options)
    kept = options.keep_runs or directory.exists or not is_brief(planned.case)
    return {
        "name": planned.name, "directory": str(directory.path) if kept else None, "case": digest_of(planned.case),
        "values": planned.values, "state": WAITING, "exit_code": None, "message": "", "results": results_of({}),
    }  # fmt: skip


def _perform(planned: PlannedRun, runs: Runs, options: SweepOptions) -> tuple[str, int, str]:
    """Make one run in its directory, unless it is finished; its state, exit code and message."""
    directory = _directory(planned, options)
    same = directory.exists and not differences(directory.stored_case(), planned.case)
    if options.resume and same and _finished(directory, options.stage):
        return KEPT, EXIT_DONE, ""
    case_file = options.folder / f"{planned.name}.toml"
    write_text(case_file, to_toml(planned.case), InputError)
    again = options.resume and same
    request: dict[str, Any] = {
        "stage": options.stage, "case_file": str(case_file), "out": str(directory.path),
        "resume": again, "overwrite": options.overwrite,
    }  # fmt: skip
    if options.scheduler is not None:  # begun again by another worker where one is lost: with what is there by then
        try:
            directory.claim(planned.case, resume=again, overwrite=options.overwrite)
        except InputError as error:
            return FAILED, exit_code_of(error), message_of(error)
        places = {name: str(Path(request[name]).resolve()) for name in ("case_file", "out")}
        request |= {**places, "resume": True, "overwrite": False, "patience": _PATIENCE}
    return _outcome(*runs.call(request))


def _outcome(code: int, message: str) -> tuple[str, int, str]:
    if code == EXIT_INTERRUPTED:
        raise KeyboardInterrupt
    return (DONE if code == EXIT_DONE else FAILED), code, message


def _fill(row: dict[str, Any], outcome: tuple[str, int, str]) -> None:
    """Fill the row of a run; one whose distance is not determined has the exit code and reason."""
    state, code, message = outcome
    if state == FAILED:
        row.update(state=state, exit_code=code, message=message)
        return
    if row["directory"] is None:
        row.update(json.loads(message))
    else:
        summary = RunDirectory(Path(row["directory"])).summary()
        results = results_of(summary)
        row.update(results=results, message=str(summary["hazard"]["reason"]) if results["determined"] is False else "")
    known = row["results"]["determined"] is not False
    row.update(state=state, exit_code=EXIT_DONE if known else EXIT_NUMERICAL)


def _finished(directory: RunDirectory, stage: str) -> bool:
    names = (stage,) if stage != "run" else tuple(name for name in STAGES if name != "report")
    return all(directory.complete(STAGES[name]) for name in names)


def _report(text: str, options: SweepOptions) -> None:
    """Name the run on stderr, before its own warnings."""
    if not options.quiet:
        sys.stderr.write(f"{text}\n")
        sys.stderr.flush()
