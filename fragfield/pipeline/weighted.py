"""The expected density from flights of weighted fragments, where the scene does not admit the integral.

They are a fixed number for each round and tolerance, in sets with fixed seeds, so that the case's seed is not in the
distance.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING

from flight.hazard.weighted import count_weighted, expected_of
from fragfield.case.conversion.attitude import is_mixed
from fragfield.case.conversion.clearance import min_clearance
from fragfield.case.conversion.rounds import placed
from fragfield.pipeline.flown import above_ground
from fragfield.pipeline.integral import Solved

if TYPE_CHECKING:
    from flight.hazard.weighted import WeightedCounts
    from fragfield.case import CaseTable
    from fragfield.pipeline.parallel import Team
    from transition import BreakUp


SETS = 8
POINTS = 2**15
"""Fragments of a set for each round, where `hazard.tolerance` is `USUAL`; in inverse proportion to it."""
USUAL = 0.02
_FEWEST, _MOST = 2**10, 2**17
_EXPANSION = 1.0  # m of two casings until they break up, with room


def why_not_weighted(case: CaseTable) -> str:
    """Why the expected density of a resolved case that is not integrated is taken from realisations; or empty."""
    if is_mixed(case):
        return "rounds of any attitude"
    return "several rounds, whose fragments may strike each other" if _may_meet(case) else ""


def _may_meet(case: CaseTable) -> bool:
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
    """Flights of weighted fragments of a case as its rounds stand. Collective."""

    case: CaseTable
    broken: BreakUp
    team: Team
    threads: int

    def solve(self) -> Solved | None:
        """The expected density, on rank 0."""
        from flight.hazard.density.directions import Directions
        from flight.hazard.pool import Completeness
        from fragfield.case.problem import hazard_criteria, hazard_directions, hazard_grid, kernel_degrees

        parts = [self._flown(number) for number in range(SETS)]
        basis, mirrors = hazard_directions(self.case)
        grid = hazard_grid(self.case)
        used = tuple(one for one in mirrors if grid.maps(one)) if basis == "worst_direction" else ()
        directions = Directions(grid, basis, kernel_degrees(self.case), used)
        completeness = sum((part.completeness for part in parts), Completeness())
        return Solved(expected_of(parts, directions, hazard_criteria(self.case)), None, completeness=completeness)

    def _flown(self, number: int) -> WeightedCounts:
        from flight import FlightWarning
        from flight.fluence import Weights
        from fragfield.case.problem import flight_arguments, hazard_criteria, hazard_grid

        made = self.broken.weighted(number, fragments_of_set(self.case, len(self.broken.rounds)))
        arguments = flight_arguments(self.case) | {"witnesses": (), "sample": 0, "contact": None, "seed": number}
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", FlightWarning)  # reported for the realisations
            return count_weighted(
                above_ground(made.fragments, arguments["ground"], warn=False), Weights(made.number, made.slopes),
                hazard_grid(self.case), hazard_criteria(self.case), **arguments, threads=self.threads,
            )  # fmt: skip
