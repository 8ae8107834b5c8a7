"""The realisations of a run, shared over the ranks: each is broken up and flown whole on one rank.

What a realisation gives does not depend on the rank that computes it, and rank 0 puts the parts together by their
numbers, so that the result is the same on any number of ranks, to the last bit.
"""

from __future__ import annotations

import logging
import time
import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from flight import FlightProgress, FlightResult, Fragments, HeightMap
    from flight.ensemble import EnsembleHazard
    from flight.tally import Tally
    from fragfield.stages import Job
    from transition import BreakUpResult

__all__ = ["FlownEnsemble", "above_ground", "break_up_all", "fly_all"]

_log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class FlownEnsemble:
    """What the flights of all realisations gave.

    Attributes
    ----------
    first : FlightResult
        The first realisation's flight, row by row.
    hazard : EnsembleHazard
        Over all.
    witnesses : dict from a surface's name to (n, s) structured arrays of dtype flight.witness_hazard.SECTOR_HITS
        Hits by realisation and sector.
    """

    first: FlightResult
    hazard: EnsembleHazard
    witnesses: dict[str, NDArray[Any]]


def break_up_all(job: Job, snapshot_file: Path) -> tuple[BreakUpResult, list[Fragments]] | None:
    """Break the casings up as often as the case asks.

    Returns
    -------
    The first realisation with its ledgers, and the fragments of the others; None on ranks other than 0.
    """
    import transition
    from fragfield.case.convert import break_up_settings

    team, seed = job.team, job.case.seed
    snapshot = team.tell(transition.Snapshot.read(snapshot_file) if team.first else None)
    assert snapshot is not None
    prepared = transition.BreakUp(snapshot, break_up_settings(job.case))
    first = prepared.realisation(seed) if team.first else None
    numbers = team.share(range(1, job.case.break_up.realisations))
    further = team.collect(prepared.many(seed, numbers, job.threads))
    return None if first is None else (first, further)


def fly_all(job: Job, realisations: Sequence[Fragments]) -> FlownEnsemble | None:
    """Fly every realisation to the ground and count what it does there and on the witness surfaces.

    Parameters
    ----------
    job : Job
        The case, the ranks, threads and progress.
    realisations : sequence of Fragments
        On rank 0; the others are told.

    Returns
    -------
    FlownEnsemble, or None on ranks other than 0
    """
    from flight.ensemble import assess_ensemble
    from flight.tally import Tally
    from fragfield.case.convert import hazard_criteria

    everything = job.team.tell(list(realisations) if job.team.first else None)
    assert everything is not None
    flown = _Flights(job, sum(len(one) for one in job.team.share(everything)))
    mine = job.team.share(list(enumerate(everything)))
    parts = job.team.collect([flown.fly(number, fragments) for number, fragments in mine])
    if not job.team.first:
        return None
    counts, tables = Tally.join([counts for counts, _ in parts]), [tables for _, tables in parts]
    witnesses = {name: np.stack([table[name] for table in tables]) for name in tables[0]}
    found = assess_ensemble(counts, hazard_criteria(job.case), tolerance=job.case.hazard.tolerance)
    assert flown.first is not None
    return FlownEnsemble(flown.first, found, witnesses)


class _Flights:
    """The flights of one rank, one after the other, with one progress."""

    def __init__(self, job: Job, fragments: int) -> None:
        from fragfield.case.convert import flight_arguments, hazard_criteria

        self.arguments = flight_arguments(job.case)
        self.criteria, self.case = hazard_criteria(job.case), job.case
        self.job, self.total, self.done = job, fragments, 0
        self.began = time.perf_counter()
        self.first: FlightResult | None = None

    def fly(self, number: int, fragments: Fragments) -> tuple[Tally, dict[str, NDArray[Any]]]:
        """Counts of one realisation, and its hits by sector on every surface."""
        import flight
        from flight.tally import tally
        from flight.witness_hazard import sector_hits

        fragments = above_ground(fragments, self.arguments["ground"], tell=number == 0)
        arguments = self.arguments if number == 0 else {**self.arguments, "sample": 0}
        with warnings.catch_warnings():
            if number > 0:  # told of the first
                warnings.simplefilter("ignore", flight.FlightWarning)
            result = flight.fly(fragments, **arguments, threads=self.job.threads, on_progress=self._progress)
        self.done += len(fragments)
        if number == 0:
            self.first = result
        width = 360.0 / self.case.hazard.sectors
        counts = tally(result, self.criteria, sector_width=width, distance=self.case.hazard.distance_cell)
        names = [surface.name for surface in result.witnesses]
        return counts, {name: sector_hits(result.hits_on(name), self.criteria, sector_width=width) for name in names}

    def _progress(self, state: FlightProgress) -> None:
        seconds = time.perf_counter() - self.began
        self.job.reporter.flight(replace(state, done=self.done + state.done, total=self.total, wall_seconds=seconds))


def above_ground(fragments: Fragments, ground: float | HeightMap, *, tell: bool = True) -> Fragments:
    """Fragments on or above the ground: a burst without a plane there may have driven a casing into it."""
    x, y, z = fragments.position.T
    height = np.full(len(z), ground) if isinstance(ground, float) else ground.at(x, y)
    below = z < height
    if not below.any():
        return fragments
    if tell:
        _log.warning(
            "%d fragments (%.3g kg) ended the burst up to %.3g m below the ground; they start on it",
            int(below.sum()), float(fragments.mass[below].sum()), float((height - z).max()),
        )  # fmt: skip
    position = fragments.position.copy()
    position[:, 2] = np.maximum(z, height)
    return replace(fragments, position=position)
