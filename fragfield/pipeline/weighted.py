"""The expected density from flights of weighted fragments, where the scene does not admit the integral.

They are flown in sets with fixed seeds, so that the case's seed is not in the distance: eight sets of a number for each
round and tolerance. Where fragments of different rounds may strike each other a set is a realisation of the break-up
instead, whose fragments have met; then each becomes several, whose directions scatter by what was left out before.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.hazard.weighted import count_weighted, expected_of
from fragfield.case.conversion.attitude import is_mixed
from fragfield.case.conversion.clearance import min_clearance
from fragfield.case.conversion.rounds import placed
from fragfield.pipeline.flown import above_ground
from fragfield.pipeline.integral import Solved

if TYPE_CHECKING:
    from collections.abc import Sequence

    from flight.fragments import Fragments
    from flight.hazard.weighted import WeightedCounts
    from fragfield.case import CaseTable
    from transition import BreakUp
    from transition.weighted import WeightedFragments


SETS = 8
POINTS = 2**15
"""Fragments of a set for each round, where `hazard.tolerance` is `USUAL`; in inverse proportion to it."""
USUAL = 0.02
_FEWEST, _MOST = 2**10, 2**17
_EXPANSION = 1.0  # m of two casings until they break up, with room
MET, _MORE = 24, 8
"""Realisations whose fragments meet: the fewest for the usual tolerance, and the fewest more."""
_AFTER = 0.5  # of the variance of directions that a fragment has after it has met others
_COPIES = 4  # of each of them near the level
_SEED = 0x5EED


def why_not_weighted(case: CaseTable) -> str:
    """Why the expected density of a resolved case that is not integrated is taken from realisations; or empty."""
    return "rounds of any attitude" if is_mixed(case) else ""


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
    """Flights of weighted fragments of a case as its rounds stand."""

    case: CaseTable
    broken: BreakUp
    threads: int

    def solve(self) -> Solved:
        """The expected density."""
        if may_meet(self.case):
            return self._met()
        number = fragments_of_set(self.case, len(self.broken.rounds))
        return self._solved([self._flown(one, self.broken.weighted(one, number)) for one in range(SETS)])

    def _solved(self, parts: Sequence[WeightedCounts]) -> Solved:
        from flight.hazard.density.directions import Directions
        from flight.hazard.pool import Completeness
        from fragfield.case.conversion.stages import hazard_criteria, hazard_directions, hazard_grid, kernel_degrees

        basis, mirrors = hazard_directions(self.case)
        grid = hazard_grid(self.case)
        used = tuple(one for one in mirrors if grid.maps(one)) if basis == "worst_direction" else ()
        directions = Directions(grid, basis, kernel_degrees(self.case), used)
        completeness = sum((part.completeness for part in parts), Completeness())
        return Solved(expected_of(parts, directions, hazard_criteria(self.case)), None, completeness=completeness)

    def _met(self) -> Solved:
        """By realisations whose fragments have met: more, until the distance is known to the tolerance."""
        from transition import BreakUp

        settings = self.broken.settings
        after = settings.direction_scatter * math.sqrt(_AFTER)
        before = replace(settings, direction_scatter=settings.direction_scatter * math.sqrt(1.0 - _AFTER))
        source = BreakUp(self.broken.snapshot, before)
        parts: list[WeightedCounts] = []
        most = max(SETS, self.case.hazard.max_realisations)
        target = min(max(SETS, round(MET * min(1.0, USUAL / self.case.hazard.tolerance) ** 2)), most)
        while True:
            numbers = range(len(parts), target)
            parts += [self._flown(one, self._after_contact(source, one, after)) for one in numbers]
            solved = self._solved(parts)
            needed = target * (solved.integral.expected().uncertainty / self.case.hazard.tolerance) ** 2
            if needed <= target or target >= most or solved.completeness.reason:
                return solved
            target = min(max(target + _MORE, math.ceil(needed)), 2 * target, most) if math.isfinite(needed) else most

    def _after_contact(self, source: BreakUp, number: int, scatter: float) -> WeightedFragments:
        from transition.draws import Draws

        arguments = self._arguments(number)
        fragments = above_ground(source.fragments(_SEED, number), arguments["ground"], warn=False)
        generator = Draws(_SEED, number).generator("scatter")
        return after_contact(fragments, scatter, generator, **arguments, threads=self.threads)

    def _arguments(self, number: int) -> dict[str, Any]:
        from fragfield.case.conversion.stages import flight_arguments

        return flight_arguments(self.case) | {"witnesses": (), "sample": 0, "seed": number}

    def _flown(self, number: int, made: WeightedFragments) -> WeightedCounts:
        from flight import FlightWarning
        from flight.fluence import Weights
        from fragfield.case.conversion.stages import hazard_criteria, hazard_grid

        arguments = self._arguments(number) | {"contact": None}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FlightWarning)  # reported for the realisations
            return count_weighted(
                above_ground(made.fragments, arguments["ground"], warn=False), Weights(made.number, made.slopes),
                hazard_grid(self.case), hazard_criteria(self.case), **arguments, threads=self.threads,
            )  # fmt: skip


def after_contact(
    fragments: Fragments, scatter: float, generator: np.random.Generator, **flight_arguments: Any
) -> WeightedFragments:
    """Fragments after their last contact with each other, whose directions then scatter (rad).

    `flight_arguments`: of `flight.fly`, with contact.
    """
    from flight import Domain, FlightWarning, fly
    from flight.integrate.legs import legs_between
    from transition.weighted import spread_out

    origin = flight_arguments.get("origin", (0.0, 0.0))
    farthest = float(np.linalg.norm(fragments.position[:, :2] - origin, axis=1).max())
    domain = Domain(radius=farthest + flight_arguments["contact"].distance)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", FlightWarning)  # reported for the realisations
        near = fly(fragments, **flight_arguments, domain=domain)
    return spread_out(legs_between(fragments, near.contacts).last(near.landing), scatter, _COPIES, generator)
