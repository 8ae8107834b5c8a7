"""Burst, break-up and flight of a case for its numbers alone: with other cells, of one round, for a row of a study."""

from __future__ import annotations

import logging
import shutil
import warnings
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.files.run_directory import RunDirectory
from fragfield.pipeline.job import Job, RunOptions
from fragfield.pipeline.parallel import Team
from fragfield.results import burst as results
from fragfield.terminal.logs import LOGGERS
from fragfield.terminal.progress import ProgressReporter

if TYPE_CHECKING:
    from collections.abc import Iterator

    from fragfield.case import CaseTable
    from fragfield.case.conversion.turned import Turned
    from fragfield.pipeline.flown import FlownEnsemble
    from transition import Snapshot

    Burst = tuple[results.Burst, Snapshot]


def burst_beside(case: CaseTable, folder: Path, team: Team) -> Burst:
    """The burst's summary, and the state at its end. On one rank; its files lie in a folder that is removed then."""
    from burst_fenicsx import simulate
    from fragfield.case.conversion.rounds import burst_rounds
    from fragfield.case.problem import burst_settings
    from transition import Snapshot

    try:
        done = simulate(burst_rounds(case), burst_settings(case), folder, comm=team.alone, series=False)
        summary = results.Burst.of_stage({**done.summary, "geometry_reason": ""})
        return summary, Snapshot.read(folder / "burst_snapshot.h5")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def flown_beside(
    case: CaseTable, snapshot: Snapshot, threads: int = 1, attitude: Turned | None = None, *, sample: bool = False
) -> tuple[FlownEnsemble, int]:
    """The numbers of a run without files; realisations are flown where it has exposed sites, or no other way.

    Parameters
    ----------
    case : CaseTable
        Resolved.
    snapshot : Snapshot
        The end of its burst.
    threads : int
        How many work on it.
    attitude : Turned, optional
        As of a `Job`.
    sample : bool
        As of an `Integrand`.

    Returns
    -------
    What was flown, and the number of fragments: expected, or of the first realisation.
    """
    import transition
    from fragfield.case.problem import break_up_settings
    from fragfield.pipeline.attitudes import fly_all
    from fragfield.pipeline.realisations import Realisations

    broken = transition.BreakUp(snapshot, break_up_settings(case))
    nowhere = RunDirectory(Path())
    options = RunOptions(nowhere.path, threads=threads, lean=True)
    job = Job(
        case, nowhere, nowhere, Team(), ProgressReporter(enabled=False), options, attitude=attitude, sample=sample
    )
    if not case.exposed:
        solved, _, _ = Realisations(job, (), broken).solve()
        if solved is not None:
            return solved.flown(case), round(broken.number)
    realisations = broken.many(case.seed, range(case.break_up.realisations), threads)
    flown = fly_all(job, realisations, broken)
    return flown, len(realisations[0])


@contextmanager
def silent() -> Iterator[None]:
    """Nothing within logs or warns: the run's log and findings are those of its own burst."""
    loggers = [logging.getLogger(name) for name in LOGGERS]
    levels = [one.level for one in loggers]
    for one in loggers:
        one.setLevel(logging.CRITICAL)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    finally:
        for one, level in zip(loggers, levels, strict=True):
            one.setLevel(level)
