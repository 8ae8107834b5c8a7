"""A study of uncertain inputs: the nominal run, the samples, the analysis, the pages."""

from __future__ import annotations

import json
import logging
import shutil
import sys
import time
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_DONE, EXIT_INTERRUPTED, InputError
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield.pipeline.chain import run_chain
from fragfield.pipeline.job import RunOptions
from fragfield.pipeline.parallel import launched_size
from fragfield.studies.runner import make_all, runs_of
from fragfield.studies.uncertainty.journal import Journal
from fragfield.studies.uncertainty.plan import plan_study
from fragfield.studies.uncertainty.results import write_results
from fragfield_base.cores import cores
from fragfield_base.writing import locked, write_text

if TYPE_CHECKING:
    from fragfield.studies.runner import Runs
    from fragfield.studies.uncertainty.plan import Study


NOMINAL, BURSTS, SCRATCH = "nominal", "bursts", ".samples"
_TRIES = 3  # of a sample whose process was killed
_REPORT_SECONDS = 20.0
_OWN = ("study.json", "samples.jsonl", "samples.csv", "uncertainty.json", "uncertainty.html", "figures")

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class StudyOptions:
    """How a study is made."""

    folder: Path
    """Holds the study."""
    samples: int | None = None
    seed: int | None = None
    """Instead of those of the case."""
    jobs: int | None = None
    """Samples at one time; left out: one for each core, or each thread of the cluster."""
    scheduler: str | None = None
    """Address of a dask scheduler, whose workers make the samples."""
    resume: bool = False
    overwrite: bool = False
    """Continue the study in the folder, or replace it."""
    quiet: bool = False
    """No progress."""


def run_study(request: RunOptions, options: StudyOptions) -> dict[str, Any]:
    """Make a study and write samples.csv, uncertainty.json, uncertainty.html and the report of the nominal run.

    Parameters
    ----------
    request : RunOptions
        The case file with its `--set`, or a run directory, which then is the nominal run.
    options : StudyOptions
        How.

    Returns
    -------
    dict
        uncertainty.json, with `directory`.

    Raises
    ------
    InputError, NumericalStop
        As the plan and the nominal run raise them; samples that fail are counted, not raised. What was computed stays,
        and `resume` goes on from there.
    """
    if launched_size() > 1:
        raise InputError("uncertainty starts its own parallel runs; it does not run under mpirun")
    study = plan_study(request.case(), samples=options.samples, seed=options.seed)
    _make_folder(options)
    with locked(options.folder, InputError):
        journal = Journal(options.folder)
        journal.begin(study.identity(), resume=options.resume, overwrite=options.overwrite)
        if options.overwrite and not options.resume:
            _remove(options.folder)
        nominal = _nominal(request, options)
        began = time.perf_counter()
        with journal:
            made = _samples(study, journal, options)
        seconds = time.perf_counter() - began
        cost = {"samples_made_now": made, "wall_seconds": seconds, "workers": options.jobs or cores()}
        found = write_results(study, journal.rows, nominal, options.folder, cost)
        _pages(nominal, options.folder, found)
    return {"directory": str(options.folder), **found}


def _make_folder(options: StudyOptions) -> None:
    folder = RunDirectory(options.folder)
    folder.make()
    if folder.exists:
        raise InputError(f"{options.folder}: holds a run; a study of uncertainty needs a folder of its own")
    known = {*_OWN, NOMINAL, BURSTS, SCRATCH}
    other = sorted(entry.name for entry in options.folder.iterdir() if entry.name.removesuffix(".part") not in known)
    if other:
        raise InputError(
            f"{options.folder}: holds {other[0]}, which is no part of a study; allowed: a new or an empty folder, or "
            "a study's"
        )


def _remove(folder: Path) -> None:
    for name in (BURSTS, SCRATCH, NOMINAL, "figures"):
        shutil.rmtree(folder / name, ignore_errors=True)
    for name in ("samples.csv", "uncertainty.json", "uncertainty.html"):
        (folder / name).unlink(missing_ok=True)


def _nominal(request: RunOptions, options: StudyOptions) -> RunDirectory:
    """The run with every input as the case has it: given as a directory, or made here."""
    if request.target.is_dir():
        directory = RunDirectory(request.target)
        if request.settings:
            raise InputError(
                f"{directory.path}: found --set with a run directory, whose run is the nominal one; "
                "allowed: with a case file"
            )
        if not directory.complete(STAGES["fly"]):
            raise InputError(f"{directory.path}: has no flight; run `fragfield run {directory.path} --resume` first")
        return directory
    directory = RunDirectory(options.folder / NOMINAL)
    done = [stage for stage in ("burst", "break-up", "fly") if directory.complete(STAGES[stage])]
    own = RunOptions(request.target, directory.path, resume=True, quiet=options.quiet, settings=request.settings)
    for stage in ("burst", "break-up", "fly"):
        if stage not in done:
            _report(f"nominal run: {stage}", options)
            run_chain(own if stage == "burst" else RunOptions(directory.path, quiet=options.quiet), stage)
    return directory


def _samples(study: Study, journal: Journal, options: StudyOptions) -> int:
    """Make the bursts that are shared, then every sample that is missing; how many were made."""
    scratch = options.folder / SCRATCH
    shutil.rmtree(scratch, ignore_errors=True)  # of a study that was killed
    scratch.mkdir()
    try:
        _shared_bursts(study, options)
        missing = [number for number in range(study.samples) if number not in journal.rows]
        if missing:
            _sample(study, missing, journal, options, str(scratch.resolve()))
        return len(missing)
    finally:
        shutil.rmtree(scratch, ignore_errors=True)


def _sample(study: Study, missing: list[int], journal: Journal, options: StudyOptions, scratch: str) -> None:
    progress = _Progress(study.samples, len(journal.rows), options)
    runs = runs_of(options.scheduler, len(missing), jobs=options.jobs)

    def make(number: int) -> tuple[int, str]:
        burst = None if study.burst is None else str(_burst_directory(options, int(study.burst[number])).path.resolve())
        asked = {"stage": "sample", "case": study.document(number), "scratch": scratch, "burst": burst}
        return _call(runs, asked)

    def ended(number: int, outcome: tuple[int, str]) -> None:
        code, message = outcome
        row = {"results": json.loads(message)} if code == EXIT_DONE else {"message": message}
        journal.add(number, {"exit_code": code, **row})
        progress.one_more()

    make_all(runs, missing, make, ended)


def _call(runs: Runs, asked: dict[str, Any]) -> tuple[int, str]:
    """A run; made again where its process was killed by a signal, which is no fault of the run."""
    code, message = runs.call(asked)
    for _ in range(_TRIES - 1):
        if code >= 0:
            break
        code, message = runs.call(asked)
    if code == EXIT_INTERRUPTED:
        raise KeyboardInterrupt
    return code, message


def _burst_directory(options: StudyOptions, number: int) -> RunDirectory:
    return RunDirectory(options.folder / BURSTS / f"burst_{number:04d}")


def _shared_bursts(study: Study, options: StudyOptions) -> None:
    """Make the bursts that samples share; a burst that fails ends the study, since many samples need it."""
    directories = [_burst_directory(options, number) for number in range(study.bursts)]
    missing = [number for number, one in enumerate(directories) if not one.complete(STAGES["burst"])]
    if not missing:
        return
    (options.folder / BURSTS).mkdir(exist_ok=True)
    runs = runs_of(options.scheduler, len(missing), jobs=options.jobs)

    def make(number: int) -> tuple[int, str]:
        _report(f"burst {number + 1} of {study.bursts}", options)
        case_file = (options.folder / BURSTS / f"burst_{number:04d}.toml").resolve()
        write_text(case_file, study.burst_text(number), InputError)
        out = directories[number].path.resolve()
        asked = {"stage": "burst", "case_file": str(case_file), "out": str(out), "resume": True, "overwrite": False}
        return _call(runs, asked)

    def ended(number: int, outcome: tuple[int, str]) -> None:
        code, message = outcome
        if code != EXIT_DONE:
            raise InputError(f"burst {number + 1} of {study.bursts} failed (exit code {code}): {message}")

    make_all(runs, missing, make, ended)


def _pages(nominal: RunDirectory, folder: Path, found: dict[str, Any]) -> None:
    """The study's own page, and its section in the report of the nominal run."""
    from fragfield.report import write_report, write_uncertainty_page

    write_uncertainty_page(folder, nominal.path, found)
    with suppress(InputError):  # a run that may only be read; the study has its own page
        nominal.make()
        write_report(nominal.path)


class _Progress:
    """Says on stderr how far the samples are, from time to time."""

    def __init__(self, samples: int, done: int, options: StudyOptions) -> None:
        self._samples, self._before, self._done = samples, done, done
        self._options = options
        self._began = self._said = time.monotonic()

    def one_more(self) -> None:
        self._done += 1
        now = time.monotonic()
        if now - self._said < _REPORT_SECONDS and self._done < self._samples:
            return
        self._said = now
        left = (now - self._began) / (self._done - self._before) * (self._samples - self._done)
        _report(f"sample {self._done} of {self._samples}, about {left / 60.0:.1f} min left", self._options)


def _report(text: str, options: StudyOptions) -> None:
    if not options.quiet:
        sys.stderr.write(f"{text}\n")
        sys.stderr.flush()
