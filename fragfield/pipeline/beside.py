"""Burst, break-up and flight of a case for its numbers alone: with other cells, of one round, for a row of a study."""

from __future__ import annotations

import logging
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import fields
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case import CaseTable
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.conversion.turned import Turned
from fragfield.case.problem import break_up_settings, burst_settings
from fragfield.files.run_directory import RunDirectory
from fragfield.pipeline.attitudes import fly_all
from fragfield.pipeline.flown import FlownEnsemble
from fragfield.pipeline.job import Job, RunOptions
from fragfield.pipeline.parallel import Team
from fragfield.pipeline.realisations import Realisations
from fragfield.results import burst as results
from fragfield.terminal.logs import LOGGERS
from fragfield.terminal.progress import ProgressReporter

if TYPE_CHECKING:
    from burst_fenicsx.files.snapshot import EndState
    from transition import Snapshot


def burst_beside(case: CaseTable, team: Team) -> tuple[results.Burst, Snapshot]:
    """The burst's summary, and the state at its end. On one rank, without files; `simulate` keeps the mesh."""
    from burst_fenicsx import simulate

    done = simulate(burst_rounds(case), burst_settings(case), None, comm=team.alone, keep_mesh=True)
    assert done.end is not None  # of one rank
    return results.Burst.of_stage({**done.summary, "geometry_reason": ""}), _snapshot(done.end)


def _snapshot(end: EndState) -> Snapshot:
    """The end of a burst as the break-up reads it from a file."""
    from transition import RoundData, Snapshot
    from transition.motion import SymmetryPlane
    from transition.snapshot import ARRAYS

    names = [one.name for one in fields(RoundData)]
    normals = [np.asarray(plane.normal) / np.linalg.norm(plane.normal) for plane in end.planes]
    arrays: dict[str, Any] = {**end.cells, **end.nodes, "cells": end.cells["nodes"]}
    return Snapshot(
        source="the burst",
        time=end.time,
        provenance={},
        rounds=tuple(RoundData(**{name: getattr(one, name) for name in names}) for one in end.rounds),
        planes=tuple(
            SymmetryPlane(plane.name, plane.point, tuple(normal.tolist()))
            for plane, normal in zip(end.planes, normals, strict=True)
        ),
        geometry=end.geometry,
        **{name: arrays[name] for name in ARRAYS},
    )


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
