"""A further burst beside a run's own: in a scratch folder of the run directory, without log, warnings or series."""

from __future__ import annotations

import logging
import shutil
import warnings
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fragfield.files.run_directory import SCRATCH

if TYPE_CHECKING:
    from collections.abc import Iterator

    from burst_fenicsx import BurstResult
    from fragfield.case import Case
    from fragfield.pipeline.job import Job
    from transition import Snapshot

__all__ = ["side_burst", "silent"]

_LOGGERS = ("fragfield", "burst_fenicsx", "transition", "flight", "py.warnings")


def side_burst(job: Job, case: Case) -> tuple[BurstResult, Snapshot]:
    """Burst a case on one rank; its result and the state at its end. Its files are removed."""
    from burst_fenicsx import simulate
    from fragfield.case.conversion.stages import burst_rounds, burst_settings
    from transition import Snapshot

    folder = job.target.file(SCRATCH)
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        done = simulate(burst_rounds(case), burst_settings(case), folder, comm=job.team.alone, series=False)
        return done, Snapshot.read(folder / "burst_snapshot.h5")
    finally:
        shutil.rmtree(folder, ignore_errors=True)


@contextmanager
def silent() -> Iterator[None]:
    """Nothing within logs or warns: the run's log and findings are those of its own burst."""
    loggers = [logging.getLogger(name) for name in _LOGGERS]
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
