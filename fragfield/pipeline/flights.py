"""The flight of a run's realisations, in the attitude of the case or over all of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield.case.conversion.attitude import is_mixed
from fragfield.pipeline.attitudes import fly_attitudes
from fragfield.pipeline.ensemble import EnsembleFlight, Flights
from fragfield.pipeline.realisations import Realisations

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flight import Fragments
    from fragfield.pipeline.ensemble import FlownEnsemble
    from fragfield.pipeline.job import Job

__all__ = ["fly_all"]


def fly_all(job: Job, realisations: Sequence[Fragments]) -> FlownEnsemble | None:
    """Fly realisations to the ground until they fix the hazard distance, and count what they do there.

    The realisations given are flown in any case. Where the burst's snapshot is at hand more are made, in batches, until
    the standard error of the distance is below `hazard.tolerance` or there are `hazard.max_realisations`.

    Parameters
    ----------
    job : Job
        The case, the ranks, threads and progress.
    realisations : sequence of Fragments
        On rank 0; the others receive them.

    Returns
    -------
    FlownEnsemble, or None on ranks other than 0
    """
    source, flights = Realisations(job, realisations), Flights(job)
    if job.attitude is None and is_mixed(job.case):
        return fly_attitudes(job, source, flights)
    one = EnsembleFlight(job, source, flights, job.attitude)
    one.fly_to_tolerance()
    return one.result() if job.team.first else None
