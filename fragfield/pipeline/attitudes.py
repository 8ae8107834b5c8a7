"""The envelope over attitudes: the fragments of every realisation turned as one body, and the worst attitude.

Attitudes are flown on a coarse grid of inclinations and rolls with the realisations of the break-up. Then the one with
the largest bound is flown with as many realisations as fix it to `hazard.tolerance`, and those beside it in finer
steps; whichever becomes the worst by that is treated alike, until the worst is known and has no neighbour that was not
flown. All attitudes fly the same realisations.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flight import Fragments
from flight.hazard.density.expected import ExpectedDistance
from flight.hazard.ensemble import EnsembleHazard
from fragfield.case import CaseTable
from fragfield.case.conversion.attitude import attitude_of, is_mixed
from fragfield.case.conversion.turned import Arrangement
from fragfield.errors import InputError
from fragfield.hazard.exposed import worst_of_attitudes
from fragfield.pipeline.arena import read_arena
from fragfield.pipeline.ensemble import EnsembleFlight, Flights
from fragfield.pipeline.flown import FlownEnsemble
from fragfield.pipeline.job import Job
from fragfield.pipeline.realisations import Realisations
from fragfield.results.hazard import Attitude, FlownAttitude
from fragfield.results.site import ExposedSite

if TYPE_CHECKING:
    from transition import BreakUp


INCLINATION = (15.0, 5.0)
"""Steps (degrees) from one inclination to the next: of the coarse grid, then beside the worst."""
ROLL = (30.0, 10.0)
"""The same of rolls."""

Key = tuple[float, float]


def coarse_attitudes(arrangement: Arrangement) -> list[Key]:
    """Inclinations and rolls (degrees) of the coarse grid; those equal by symmetry once."""
    inclinations = np.arange(0.0, 180.0 + 0.5 * INCLINATION[0], INCLINATION[0]).tolist()
    rolls = np.arange(0.0, 360.0, ROLL[0]).tolist()
    return list(dict.fromkeys(_key(arrangement, one, roll) for one in inclinations for roll in rolls))


def fly_all(job: Job, realisations: Sequence[Fragments], prepared: BreakUp | None = None) -> FlownEnsemble:
    """Fly realisations to the ground until they fix the hazard distance, and count what they do there.

    The realisations given are flown in any case. Where the burst's snapshot is at hand more are made, in batches, until
    the standard error of the distance is below `hazard.tolerance` or there are `hazard.max_realisations`.

    Parameters
    ----------
    job : Job
        The case, threads and progress.
    realisations : sequence of Fragments
        The first ones.
    prepared : BreakUp, optional
        Makes more of them, instead of the burst's snapshot.
    """
    source, flights = Realisations(job, realisations, prepared), Flights(job)
    found, method, reason = source.solve()
    if method == "realisations" and job.attitude is None and is_mixed(job.case):
        return fly_attitudes(job, source, flights)
    attitude = job.attitude if found is None else found.attitude
    one = EnsembleFlight(job, source, flights, attitude, None if found is None else found.integral)
    one.fly_to_tolerance()
    flown = replace(one.result(), not_integrated_because=reason)
    if found is None or not found.curve:
        return flown
    hazard = replace(flown.hazard, expected=everywhere(flown.hazard.expected))
    return replace(flown, hazard=hazard, attitude=attitude, curve=found.curve)


def everywhere(expected: ExpectedDistance) -> ExpectedDistance:
    """The distance of the worst direction in every direction: which way the nose points is not known."""
    bound = np.nan if expected.upper is None else expected.upper
    return replace(
        expected, by_direction=np.full_like(expected.by_direction, expected.distance),
        upper_by_direction=np.full_like(expected.upper_by_direction, bound),
    )  # fmt: skip


def fly_attitudes(job: Job, source: Realisations, flights: Flights) -> FlownEnsemble:
    """Fly an arrangement of mixed attitudes: the ensemble of the worst attitude, with the curve over all.

    Raises InputError: the fragments are from a file: how they would turn is not known.
    """
    if job.options.fragments is not None and source.arena is None:
        raise InputError(
            f'round[1].attitude: found "any" with the fragments of {job.options.fragments.name}; allowed: an arena '
            "table, or fragments of the attitude that they have in the file, with attitude left out"
        )
    return _Envelope(job, source, flights).result()


def _key(arrangement: Arrangement, inclination: float, roll: float) -> Key:
    """An attitude by its inclination and the smallest equal roll; a roll about the vertical is one in azimuth alone."""
    if arrangement.even or inclination in (0.0, 180.0):
        return inclination, 0.0
    return inclination, arrangement.roll(roll)


class _Envelope:
    """The flights of all attitudes."""

    def __init__(self, job: Job, source: Realisations, flights: Flights) -> None:
        self.job, self.source, self.all = job, source, flights
        self.arrangement = Arrangement(job.case)
        self.flown: dict[Key, EnsembleFlight] = {}
        self.rows: dict[Key, FlownAttitude] = {}

    def result(self) -> FlownEnsemble:
        """Fly all that is needed, and give what the worst attitude gave."""
        coarse = coarse_attitudes(self.arrangement)
        self.all.expected = len(coarse) * self.source.count
        for key in coarse:
            self._fly(key, self.source.count)
        while (following := self._next()) is not None:
            self._fly(*following)
        worst = self.flown[self._worst]
        flown = worst.result()
        hazard = replace(flown.hazard, expected=everywhere(flown.hazard.expected))
        return replace(
            flown, hazard=hazard, exposed=self._exposed(hazard), attitude=worst.attitude,
            flights=sum(one.done for one in self.flown.values()),
            curve=tuple(self.rows[key] for key in sorted(self.rows)),
        )  # fmt: skip

    def _exposed(self, hazard: EnsembleHazard) -> tuple[ExposedSite, ...]:
        """What the exposed sites meet, each in its worst attitude of those flown."""
        entries = []
        for key, one in sorted(self.flown.items()):
            ended = not one.pool.completeness.reason
            entries.append((key, one.exposed.assess(hazard, determined=ended)))
        return worst_of_attitudes(entries) if self.job.case.exposed else ()

    def _fly(self, key: Key, number: int) -> None:
        """Fly an attitude to this number of realisations."""
        if key not in self.flown:
            turned = self.arrangement.turned(*key)
            self.flown[key] = EnsembleFlight(self.job, self.source, self.all, turned)
        one = self.flown[key]
        self.all.expected = max(self.all.expected, sum(each.done for each in self.flown.values()) + number - one.done)
        one.fly(number)
        expected = one.pool.expected()
        self.rows[key] = FlownAttitude.read(
            {
                "inclination_deg": key[0],
                "roll_deg": key[1],
                "expected": expected.distance,
                "upper": expected.upper,
                "standard_error": expected.standard_error,
                "direction_deg": expected.direction,
                "realisations": one.done,
            }
        )

    @property
    def _worst(self) -> Key:
        """The attitude with the largest bound; one whose distance is not determined before all others."""

        def reach(key: Key) -> float:
            row = self.rows[key]
            if self.flown[key].pool.completeness.reason:
                return np.inf
            return row.expected or 0.0 if row.upper is None else row.upper

        return max(sorted(self.rows), key=reach)

    def _next(self) -> tuple[Key, int] | None:
        """The attitude to fly next and how many realisations to have of it; None once the worst is known."""
        worst = self._worst
        one = self.flown[worst]
        wanted = one.wanted()
        if wanted > one.done:
            return worst, wanted
        return next(((key, self.source.count) for key in self._beside(worst) if key not in self.flown), None)

    def _beside(self, key: Key) -> Iterator[Key]:
        """Attitudes beside one, in the finer steps."""
        inclination, roll = key
        at_pole = inclination in (0.0, 180.0)
        rolls = np.arange(0.0, 360.0, ROLL[0]).tolist() if at_pole else [roll]
        for step in _both_ways(INCLINATION):
            if 0.0 <= inclination + step <= 180.0:
                yield from (_key(self.arrangement, inclination + step, one) for one in rolls)
        if not at_pole:
            yield from (_key(self.arrangement, inclination, roll + step) for step in _both_ways(ROLL))


def _both_ways(steps: tuple[float, ...]) -> list[float]:
    return [sign * step for step in steps[1:] for sign in (-1.0, 1.0)]


def attitudes_of(case: CaseTable) -> int:
    """How many attitudes of the coarse grid a resolved case of mixed attitudes is flown in."""
    return len(coarse_attitudes(Arrangement(case)))


def flown_attitude(job: Job, flown: FlownEnsemble) -> Attitude:
    """The attitude of what was flown, and the curve over mixed ones."""
    fragments = job.options.fragments
    part = attitude_of(job.case, given=fragments is not None and read_arena(fragments, job.case) is None)
    if flown.attitude is None or not flown.curve:
        return part
    worst = flown.attitude
    azimuth = None if job.case.flight.wind.is_still else worst.azimuth % 360.0
    return replace(
        part, worst_inclination_deg=worst.inclination, worst_roll_deg=worst.roll, worst_azimuth_deg=azimuth,
        curve=tuple(flown.curve),
    )  # fmt: skip
