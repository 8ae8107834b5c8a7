"""The expected density from flights of weighted fragments, where the scene does not admit the integral.

They are flown in sets with fixed seeds, so that the case's seed is not in the distance: eight sets of a number for each
round and tolerance. Where fragments of different rounds may strike each other a set is of few, flown without contact,
and of what contact changes in a realisation of the break-up, whose struck fragments become several of other elevations.
"""

from __future__ import annotations

import math
import warnings
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import FlightWarning
from flight.hazard.weighted import count_weighted, expected_of
from fragfield.case.conversion.attitude import is_mixed
from fragfield.case.conversion.clearance import min_clearance
from fragfield.case.conversion.rounds import placed
from fragfield.case.conversion.turned import Arrangement
from fragfield.pipeline.flown import above_ground
from fragfield.pipeline.integral import Solved, worst_attitudes
from transition.motion import Isometry
from transition.weighted import WeightedFragments, unit_points

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flight.fragments import Fragments
    from flight.hazard.weighted import WeightedCounts
    from fragfield.case import CaseTable
    from fragfield.case.conversion.turned import Turned
    from transition import BreakUp
    from transition.weighted import Casings


SETS = 8
POINTS = 2**15
"""Fragments of a set for each round, where `hazard.tolerance` is `USUAL`; in inverse proportion to it."""
USUAL = 0.02
_FEWEST, _MOST = 2**10, 2**17
SEARCHED, FEWEST_SEARCHED, WORST = 8, 2**11, 4
"""Times fewer of them where the worst attitude is searched, but not fewer than so many; attitudes flown with all."""
_EXPANSION = 1.0  # m of two casings until they break up, with room
MET, _MORE = 24, 8
"""Realisations whose fragments meet: the fewest for the usual tolerance, and the fewest more."""
BESIDE = 2**12
"""Fragments of a set for each round that fly without contact beside such a realisation."""
_SMOOTHED = 0.75  # of the scatter of directions: the width by which elevations are smoothed after contact
_SEED = 0x5EED


def why_not_weighted(case: CaseTable) -> str:
    """Why the expected density of a resolved case that is not integrated is taken from realisations; or empty."""
    if not is_mixed(case):
        return ""
    if case.exposed:
        return "exposed sites beside rounds of any attitude"
    return "" if Arrangement(case).even else "several rounds of any attitude, or one that is not of revolution"


def may_meet(case: CaseTable) -> bool:
    """Whether fragments of different rounds can strike each other: rounds do not stand far apart."""
    collisions = case.flight.collisions
    if collisions == "none":
        return False
    if any(plane.kind == "symmetry" for plane in case.plane):
        return True
    nearest = min_clearance([placed(entry) for entry in case.round])
    return nearest is not None and nearest[2] < 2.0 * collisions.distance + _EXPANSION


def fragments_of_set(case: CaseTable, rounds: int) -> int:
    """Fragments of a set for so many rounds: a power of two."""
    each = min(max(POINTS * USUAL / case.hazard.tolerance, _FEWEST), _MOST)
    return 2 ** round(math.log2(each) + math.ceil(math.log2(rounds)))


@dataclass(frozen=True, eq=False)
class WeightedFlights:
    """Flights of weighted fragments of a case."""

    case: CaseTable
    broken: BreakUp
    threads: int

    def solve(self, attitude: Turned | None = None) -> Solved:
        """The expected density in an attitude, or as the rounds stand; of mixed ones, left out, in the worst of all.

        All are flown with few fragments, and the worst of them with the full number.
        """
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FlightWarning)  # reported for the realisations
            if attitude is None and is_mixed(self.case):
                few = max(fragments_of_set(self.case, 1) // SEARCHED, FEWEST_SEARCHED)
                worst, curve = worst_attitudes(self.case, lambda one: self._turned(one, few).integral.expected())
                solved = [self._turned(one) for one in worst[:WORST]]
                return replace(max(solved, key=lambda one: one.integral.expected().distance), curve=curve)
            return self._met() if attitude is None and may_meet(self.case) else self._turned(attitude)

    @cached_property
    def _casings(self) -> list[Casings]:
        return [self.broken.casings(one) for one in range(SETS)]

    def _turned(self, attitude: Turned | None, number: int | None = None) -> Solved:
        """By so many fragments of each set."""
        number = number or fragments_of_set(self.case, len(self.broken.rounds))
        motion = None if attitude is None else Isometry(attitude.matrix, attitude.shift)
        own = self if attitude is None else replace(self, case=attitude.case)
        casings = self._casings if is_mixed(self.case) else map(self.broken.casings, range(SETS))  # kept if used again
        parts = [
            own._flown(one, casing.at(unit_points(one, number), motion), self.threads)
            for one, casing in enumerate(casings)
        ]
        return replace(own._solved(parts), attitude=attitude)

    def _solved(self, parts: Sequence[WeightedCounts]) -> Solved:
        from flight.hazard.pool import Completeness
        from fragfield.case.problem import density_directions, hazard_criteria, hazard_directions

        directions = density_directions(self.case, *hazard_directions(self.case))
        completeness = sum((part.completeness for part in parts), Completeness())
        return Solved(expected_of(parts, directions, hazard_criteria(self.case)), None, completeness=completeness)

    def _met(self) -> Solved:
        """By sets with a realisation whose fragments meet: more, until the distance is known to the tolerance."""
        points = 2 ** math.ceil(math.log2(BESIDE * len(self.broken.rounds)))
        casings = self._casings

        def flown(number: int) -> WeightedCounts:
            arguments = self._arguments(number)
            fragments = above_ground(self.broken.fragments(_SEED, number), arguments["ground"], warn=False)
            width = _SMOOTHED * self.broken.settings.direction_scatter
            generator = np.random.default_rng([_SEED, number])
            alone = casings[number % SETS].at(unit_points(number, points))
            parts = alone, *by_contact(fragments, width, generator, **arguments)
            return self._flown(number, WeightedFragments.concatenate(parts), 1)

        parts: list[WeightedCounts] = []
        tolerance, most = self.case.hazard.tolerance, max(SETS, self.case.hazard.max_realisations)
        target = min(max(SETS, round(MET * min(1.0, USUAL / tolerance) ** 2)), most)
        with ThreadPoolExecutor(self.threads) as pool:
            while True:
                parts += pool.map(flown, range(len(parts), target))
                solved = self._solved(parts)
                needed = target * (solved.integral.expected().uncertainty / tolerance) ** 2
                if needed <= target or target >= most or solved.completeness.reason:
                    return solved
                more = min(max(target + _MORE, math.ceil(needed)), 2 * target) if math.isfinite(needed) else most
                target = min(more, most)

    def _arguments(self, number: int) -> dict[str, Any]:
        from fragfield.case.problem import flight_arguments

        return flight_arguments(self.case) | {"witnesses": (), "sample": 0, "seed": number}

    def _flown(self, number: int, made: WeightedFragments, threads: int) -> WeightedCounts:
        from flight.fluence import Weights
        from fragfield.case.problem import hazard_criteria, hazard_grid

        arguments = self._arguments(number) | {"contact": None}
        return count_weighted(
            above_ground(made.fragments, arguments["ground"], warn=False), Weights(made.number, made.slopes),
            hazard_grid(self.case), hazard_criteria(self.case), **arguments, threads=threads,
        )  # fmt: skip


def by_contact(
    fragments: Fragments, width: float, generator: np.random.Generator, **flight_arguments: Any
) -> tuple[WeightedFragments, ...]:
    """What contact changes: the fragments that it struck as they fly on after their last one, less them as launched.

    All others fly as without contact. The numbers of the second are negative; both have their elevations smoothed by
    a width (rad). `flight_arguments`: of `flight.fly`, with contact.
    """
    from flight import CONTACTS, Domain, fly
    from flight.integrate.contact import legs_between
    from transition.weighted import spread_out

    origin = flight_arguments.get("origin", (0.0, 0.0))
    farthest = float(np.linalg.norm(fragments.position[:, :2] - origin, axis=1).max())
    domain = Domain(radius=farthest + flight_arguments["contact"].distance)
    near = fly(fragments, **flight_arguments, threads=1, domain=domain)
    legs = legs_between(fragments, np.zeros(0, dtype=CONTACTS) if near.contacts is None else near.contacts)
    struck = near.landing["time"] >= legs.clock[legs.first[:-1], 1]
    if not struck.any():
        return ()
    last = legs.last(near.landing)
    after, launched = (
        spread_out(one, one.segment.astype(np.int64), width, generator)
        for one in (legs.fragments.select(last[struck[legs.owner[last]]]), fragments.select(struck))
    )
    return after, launched._replace(number=-launched.number)
