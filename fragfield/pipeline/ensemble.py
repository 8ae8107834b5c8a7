"""The realisations of a run, flown in batches: more are made until the hazard distance is known well enough."""

from __future__ import annotations

import logging
import math
import time
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.pipeline.flown import FlownEnsemble, above_ground

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

    from flight import FlightProgress, FlightResult, Fragments
    from flight.hazard.integral import Integral
    from flight.hazard.pool import FlightCounts
    from fragfield.case.conversion.turned import Turned
    from fragfield.hazard.exposed import ExposedCounts
    from fragfield.pipeline.job import Job
    from fragfield.pipeline.realisations import Realisations
    from transition import BreakUpResult


_AT_ONCE = 48  # realisations of a batch
_FEWEST_MORE = 12

_log = logging.getLogger(__name__)


def break_up_all(job: Job, snapshot_file: Path) -> tuple[BreakUpResult, list[Fragments]]:
    """Break the casings up as often as the case asks: the first realisation, and the fragments of the others."""
    import transition
    from fragfield.case.problem import break_up_settings

    seed = job.case.seed
    prepared = transition.BreakUp(transition.Snapshot.read(snapshot_file), break_up_settings(job.case))
    further = prepared.many(seed, range(1, job.case.break_up.realisations), job.options.threads)
    return prepared.realisation(seed), further


class EnsembleFlight:
    """The realisations of a run flown in one attitude, batch after batch.

    Attributes
    ----------
    attitude : Turned or None
        Of the arrangement, whose fragments are turned; None as it stands.
    integral : Integral or None
        The expected density in this attitude; None where the realisations give it.
    done : int
        Realisations flown.
    pool : PooledFlights
        What they gave.
    exposed : ExposedSums
        What the exposed sites met.
    """

    def __init__(
        self, job: Job, source: Realisations, flights: Flights, attitude: Turned | None = None,
        integral: Integral | None = None,
    ) -> None:  # fmt: skip
        from flight.hazard.pool import PooledFlights
        from fragfield.case.conversion.exposed_sites import exposed_sites_of
        from fragfield.case.problem import density_directions, hazard_criteria, hazard_directions
        from fragfield.hazard.exposed import ExposedSums
        from fragfield.pipeline.arena import arena_basis

        self.source, self.flights, self.attitude, self.integral = source, flights, attitude, integral
        placed = {} if attitude is None else {"round": attitude.case.round, "plane": attitude.case.plane}
        case = self.case = job.case.model_copy(update=placed)
        if source.arena is not None:
            basis = arena_basis(case)
        else:
            basis = hazard_directions(case, elsewhere=job.options.fragments is not None)
        directions = density_directions(case, *basis)
        self.pool = PooledFlights(directions, hazard_criteria(case), ricochet=case.flight.ground.ricochet != "none")
        self.exposed = ExposedSums(
            case, exposed_sites_of(case), directions.grid, directions.kernel, turned=attitude is not None,
            alike=directions.axisymmetric,
        )  # fmt: skip
        self.done = 0
        self.first: FlightResult | None = None
        self._tables: list[dict[str, NDArray[Any]]] = []

    def fly(self, number: int) -> None:
        """Fly further realisations, up to this number."""
        while self.done < number:
            batch = range(self.done, min(self.done + _AT_ONCE, number))
            if batch.stop > self.source.count:
                self.source.prepare()
            parts = self.flights.many(batch, self._fragments)
            if batch.start == 0:
                self.first = self.flights.first
            self.done = batch.stop
            for part in parts:  # in the order of their numbers, so that no sum depends on threads
                self.pool.add(part.counts)
                if self.exposed.sites:
                    self.exposed.add(part.exposed, part.exposed_short)
                if part.tables is not None:
                    self._tables.append(part.tables)

    def _fragments(self, number: int) -> Fragments:
        fragments = self.source[number]
        return fragments if self.attitude is None else self.attitude.fragments(fragments)

    def fly_to_tolerance(self) -> None:
        """Fly the realisations at hand, and more until they fix the distance."""
        target = self.source.count
        while self.done < target:
            self.flights.expected = target
            self.fly(target)
            target = self.wanted()

    def wanted(self) -> int:
        """How many realisations to have, as many as there are where they are enough."""
        done, most, tolerance = self.done, self.case.hazard.max_realisations, self.case.hazard.tolerance
        if not self.source.more or done >= most or self.pool.completeness.reason:
            return done
        if self.integral is not None and not self.exposed.sites:
            return done
        error = self.pool.expected().uncertainty
        if error <= tolerance:
            return done
        needed = math.ceil(1.1 * done * (error / tolerance) ** 2) if math.isfinite(error) else most
        return min(max(needed, done + _FEWEST_MORE), max(2 * done, done + _AT_ONCE), most)

    def result(self) -> FlownEnsemble:
        """The whole, once all have been flown."""
        from fragfield.hazard.verdict import beyond_map_words

        assert self.first is not None
        witnesses = {name: np.stack([table[name] for table in self._tables]) for name in self._tables[0]}
        unended = self.pool.completeness.reason
        found = self.pool.hazard(self.case.hazard.tolerance, integral=self.integral)
        found = replace(found, undetermined=unended or beyond_map_words(self.case, found.expected))
        exposed = self.exposed.assess(found, determined=not unended) if self.exposed.sites else []
        return FlownEnsemble(
            self.first, found, witnesses, self.pool.completeness, self.source.more, exposed, self.pool.realisations
        )


@dataclass(frozen=True, eq=False)
class _Part:
    """What one realisation gave: `tables` of the kept ones alone, `exposed_short` what is without ricochet."""

    counts: FlightCounts
    tables: dict[str, NDArray[Any]] | None
    exposed: ExposedCounts
    exposed_short: ExposedCounts


class Flights:
    """Flights with one progress: the first on all threads, the others side by side."""

    def __init__(self, job: Job) -> None:
        from fragfield.case.problem import flight_arguments, hazard_criteria, hazard_grid
        from fragfield.hazard.exposed import ExposedPlaces

        self.arguments = flight_arguments(job.case)
        if job.options.lean:
            self.arguments["sample"] = 0  # no paths for ParaView
        self.criteria, self.case = hazard_criteria(job.case), job.case
        self.near = self.criteria.fluence_grid(hazard_grid(job.case))
        self.exposed = ExposedPlaces.of(job.case, self.near)
        self.own = len(self.arguments["witnesses"])  # the case's own surfaces come first
        self.arguments["witnesses"] += self.exposed.surfaces
        self.job, self.done, self.total = job, 0, 0
        self.expected = job.case.break_up.realisations
        self.began = time.perf_counter()
        self.first: FlightResult | None = None

    def many(self, numbers: Sequence[int], fragments: Callable[[int], Fragments]) -> list[_Part]:
        """Counts of realisations, whose fragments a function gives or makes; none depends on those beside it."""
        import flight

        waiting = list(numbers)
        parts = [self._alone(fragments(waiting.pop(0)))] if waiting and waiting[0] == 0 else []
        if not waiting:
            return parts
        workers = min(self.job.cores, len(waiting))

        def flown(number: int) -> tuple[int, _Part]:
            one = fragments(number)
            return len(one), self._fly(number, one, threads=self.job.cores // workers)

        with warnings.catch_warnings(), ThreadPoolExecutor(workers) as pool:
            warnings.simplefilter("ignore", flight.FlightWarning)  # reported for the first
            for count, part in pool.map(flown, waiting):
                parts.append(part)
                self._expect(count)
                self.done += count
                self._progress(flight.FlightProgress(0, 0, 0.0))
        return parts

    def _alone(self, fragments: Fragments) -> _Part:
        """The first realisation, whose rows are kept."""
        self._expect(len(fragments))
        part = self._fly(0, fragments, threads=self.job.cores, on_progress=self._progress)
        self.done += len(fragments)
        return part

    def _fly(
        self, number: int, fragments: Fragments, *, threads: int,
        on_progress: Callable[[FlightProgress], None] | None = None,
    ) -> _Part:  # fmt: skip
        """Counts of one realisation, and its hits by sector on every surface."""
        import flight
        from flight.hazard.density.density_counts import density_counts
        from flight.hazard.density.sectors import sector_hits
        from flight.hazard.pool import KEPT, FlightCounts
        from fragfield.hazard.exposed import ExposedCounts

        ground = self.arguments["ground"]
        fragments = above_ground(fragments, ground, warn=number == 0)
        arguments = self.arguments if number == 0 else {**self.arguments, "sample": 0}
        arguments = {**arguments, "seed": _seed(self.case.seed, number)}
        result = flight.fly(fragments, **arguments, fluence=self.near, threads=threads, on_progress=on_progress)
        buildings = [self.exposed.count(result, fragments, self.own, ricochet=one) for one in (True, False)]
        if len(result.witnesses) > self.own:
            own = result.hits["witness"] < self.own
            result = replace(result, witnesses=result.witnesses[: self.own], hits=result.hits[own])
        result.summary["hits"] = len(result.hits)
        if number == 0:
            self.first = result
        counts = FlightCounts.of(result, fragments, ground=ground, gravity=self.case.flight.gravity)
        fields = {(self.near.energy, self.near.height): (counts.density, counts.without_ricochet)}
        for grid in self.exposed.further:  # sites with an energy or height of their own: the same flight, counted again
            again = flight.fly(fragments, **{**arguments, "witnesses": (), "sample": 0}, fluence=grid, threads=threads)
            fields[grid.energy, grid.height] = density_counts(again), density_counts(again, ricochet=False)
        exposed, without = (
            ExposedCounts({key: both[leg] for key, both in fields.items()}, buildings[leg]) for leg in (0, 1)
        )
        if number >= KEPT:
            return _Part(counts, None, exposed, without)
        names, width = [surface.name for surface in result.witnesses], 360.0 / self.case.hazard.sectors
        tables = {name: sector_hits(result.hits_on(name), self.criteria, sector_width=width) for name in names}
        return _Part(counts, tables, exposed, without)

    def _expect(self, fragments: int) -> None:
        """How many fragments there will be, if all realisations have so many."""
        self.total = max(self.done + fragments, self.expected * fragments)

    def _progress(self, state: FlightProgress) -> None:
        seconds = time.perf_counter() - self.began
        self.job.reporter.flight(replace(state, done=self.done + state.done, total=self.total, wall_seconds=seconds))


def _seed(seed: int, number: int) -> int:
    """Seed of what is drawn in the flight of a realisation, which is independent of the others."""
    return int(np.random.SeedSequence(seed, spawn_key=(number,)).generate_state(1, np.uint64)[0]) if number else seed
