"""Fragments of one round of a case as if it stood alone, for the rules that are made for single rounds."""

from __future__ import annotations

import logging
import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

from fragfield.case.conversion.single_round import single_round_case
from fragfield.errors import EXIT_FAULT, exit_code_of, message_of
from fragfield.pipeline.side_burst import side_burst, silent

if TYPE_CHECKING:
    from flight import Fragments
    from flight.hazard.tp12 import PolarField
    from fragfield.case import Case
    from fragfield.pipeline.job import Job
    from transition import Snapshot

__all__ = ["SingleRound", "single_round"]

REALISATIONS = 12
"""Break-ups of the round: of an M107 they fix the beam distance to 0.4 % and that of a stack to 0.6 %."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class SingleRound:
    """The fragments of one round by polar angle.

    Attributes
    ----------
    field : PolarField or None
        None where there is none.
    source : str
        Where they come from, or why there are none.
    """

    field: PolarField | None
    source: str


def single_round(job: Job) -> SingleRound:
    """Break up one round of the case alone: from the run's own burst where that is axisymmetric, else from another.

    The other is the burst of one round in its meridian with the run's settings and cells, which takes seconds. The
    round is not tilted. On one rank.
    """
    from flight.hazard.tp12 import PolarField

    burst = job.source.summary().get("burst") or {}
    own = job.source.file("burst_snapshot.h5")
    began = time.perf_counter()
    try:
        if burst.get("geometry") == "axisymmetric" and own.is_file():
            from transition import Snapshot

            with silent():
                fragments = _fragments(job, job.case, Snapshot.read(own))
            return SingleRound(PolarField.of(fragments, job.case.round[0].axis), "this run's burst")
        alone, reason = single_round_case(job.case)
        if alone is None:
            return SingleRound(None, f"no single round: {reason}")
        if job.options.lean:
            return SingleRound(None, "no single round: not computed for the runs of a sweep")
        with silent():
            done, snapshot = side_burst(job, alone)
            fragments = _fragments(job, alone, snapshot)
    except Exception as error:
        if not isinstance(error, ImportError) and exit_code_of(error) == EXIT_FAULT:
            raise
        return SingleRound(None, f"no single round: it could not be computed: {message_of(error)}")
    _log.info("single round: burst alone and broken up in %.1f s", time.perf_counter() - began)
    size = 1e3 * float(done.summary["cell_size"])
    return SingleRound(PolarField.of(fragments), f"the round alone, burst in its meridian with cells of {size:.3g} mm")


def _fragments(job: Job, case: Case, snapshot: Snapshot) -> list[Fragments]:
    import transition
    from fragfield.case.conversion.stages import break_up_settings

    upright = case.model_copy(update={"break_up": case.break_up.model_copy(update={"tilt": 0.0})})
    broken = transition.BreakUp(snapshot, break_up_settings(upright))
    return broken.many(case.seed, range(REALISATIONS), job.options.threads)
