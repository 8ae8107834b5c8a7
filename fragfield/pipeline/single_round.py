"""The fragments of one round of a run alone, for the rules that ask for them."""

from __future__ import annotations

import logging
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flight import Fragments
from fragfield.case import CaseTable
from fragfield.case.conversion.rounds import are_alike
from fragfield.case.problem import break_up_settings, burst_geometry
from fragfield.case.tables.round import IgnitionTable
from fragfield.errors import EXIT_FAULT, exit_code_of, message_of
from fragfield.hazard.tp12 import PolarField
from fragfield.pipeline.beside import burst_beside, silent
from fragfield.pipeline.job import Job

if TYPE_CHECKING:
    from transition import Snapshot


REALISATIONS = 12
"""Break-ups of the round: of an M107 they fix the beam distance to 0.4 % and that of a stack to 0.6 %."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class SingleRound:
    """The fragments of one round by polar angle."""

    field: PolarField | None
    """None where there is none."""
    source: str
    """Where they come from, or why there are none."""


def single_round(job: Job, realisations: Sequence[Fragments]) -> SingleRound:
    """Break up one round of the case alone: from the run's own burst where that is axisymmetric, else from another.

    The run's own `realisations` are taken where they are those of an upright round.

    The other is the burst of one round in its meridian with the run's settings and cells, which takes seconds. The
    round is not tilted. On one rank.
    """
    if job.options.fragments is not None:
        return SingleRound(None, "no single round: the fragments come from a file, not from a burst")
    burst = job.source.results().burst
    own = job.source.file("burst_snapshot.h5")
    began = time.perf_counter()
    try:
        if burst is not None and burst.geometry == "axisymmetric" and own.is_file():
            from transition import Snapshot

            if job.case.break_up.tilt == 0.0 and len(realisations) >= REALISATIONS:
                fragments = [realisations[number] for number in range(REALISATIONS)]
            else:
                with silent():
                    fragments = _fragments(job, job.case, Snapshot.read(own))
            return SingleRound(PolarField.of(fragments, job.case.round[0].axis), "this run's burst")
        alone, reason = single_round_case(job.case)
        if alone is None:
            return SingleRound(None, f"no single round: {reason}")
        if job.options.lean:
            return SingleRound(None, "no single round: not computed for the runs of a sweep")
        with silent():
            summary, snapshot = burst_beside(alone, job.team)
            fragments = _fragments(job, alone, snapshot)
    except Exception as error:
        if not isinstance(error, ImportError) and exit_code_of(error) == EXIT_FAULT:
            raise
        return SingleRound(None, f"no single round: it could not be computed: {message_of(error)}")
    _log.info("single round: burst alone and broken up in %.1f s", time.perf_counter() - began)
    size = 1e3 * summary.cell_size
    return SingleRound(PolarField.of(fragments), f"the round alone, burst in its meridian with cells of {size:.3g} mm")


def _fragments(job: Job, case: CaseTable, snapshot: Snapshot) -> list[Fragments]:
    import transition

    upright = case.model_copy(update={"break_up": case.break_up.model_copy(update={"tilt": 0.0})})
    broken = transition.BreakUp(snapshot, break_up_settings(upright))
    return broken.many(case.seed, range(REALISATIONS), job.options.threads)


def single_round_case(case: CaseTable) -> tuple[CaseTable | None, str]:
    """The case of one round alone, burst in its meridian with the same settings and cells.

    Rounds may differ in name, position, axis and delay, and those that wait for the shock of a neighbour are taken to
    be initiated as the others are.

    Returns
    -------
    case, reason
        None, and why, where the rounds differ, come from mesh files, or are not initiated on their axes.
    """
    if case.burst is None or not case.round:
        return None, "the case has no rounds"
    if not are_alike(case):
        return None, "the rounds differ in contents or casing"
    points = {_stations(entry.ignition) for entry in case.round if entry.ignition}
    if len(points) != 1:
        return None, "the rounds are initiated at different points" if points else "no round has an ignition point"
    first = next(entry for entry in case.round if entry.ignition)
    began = min(point.delay for point in first.ignition or [])
    ignition = [point.model_copy(update={"delay": point.delay - began}) for point in first.ignition or []]
    alone = first.model_copy(
        update={"position": (0.0, 0.0, 0.0), "axis": (0.0, 0.0, 1.0), "ignition": ignition, "initiation": None}
    )
    output = case.burst.output.model_copy(update={"interval": case.burst.time_limit})
    burst = case.burst.model_copy(update={"convergence": "off", "geometry": "auto", "output": output})
    made = case.model_copy(update={"round": [alone], "stack": None, "plane": [], "burst": burst})
    choice = burst_geometry(made)
    return (made, "") if choice.geometry == "axisymmetric" else (None, choice.reason)


def _stations(points: list[IgnitionTable] | None) -> tuple[tuple[object, ...], ...]:
    """Ignition points of a round with their delays after its first one."""
    began = min(point.delay for point in points or [])
    return tuple(sorted((point.station, point.offset, round(point.delay - began, 12)) for point in points or []))
