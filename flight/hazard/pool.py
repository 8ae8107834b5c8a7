"""Flights of realisations pooled: densities over all, how flights ended, and what the first realisations did alone."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from flight.constants import STANDARD_GRAVITY
from flight.hazard.completeness import Completeness
from flight.hazard.density.density_counts import density_counts
from flight.hazard.density.estimate import Estimate
from flight.hazard.density.expected import DRAWS, expected_distance
from flight.hazard.density.groups import DensityGroups
from flight.hazard.density.tally import Tally, tally
from flight.hazard.ensemble import EnsembleHazard

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from flight.hazard.criteria import Criteria
    from flight.hazard.density.directions import Directions
    from flight.hazard.density.distance import ExpectedDistance
    from flight.result import FlightResult
    from flight.scene.height_map import HeightMap

    Array = NDArray[np.float64]

__all__ = ["KEPT", "TOLERANCE", "FlightCounts", "PooledFlights"]

KEPT = 200
"""Realisations whose own numbers are kept: they show what single events do, in files of bounded size."""
TOLERANCE = 0.02
"""Standard error of a hazard distance that counts as converged, as a fraction of it."""


@dataclass(frozen=True, eq=False)
class FlightCounts:
    """What the flight of one realisation adds to a pool.

    Attributes
    ----------
    density, without_ricochet : two (a, r) float64
        Landings and path lengths over height by cell (`density_counts`): of all, and before the first impact on the
        ground.
    completeness : Completeness
        How the flights ended.
    tally : Tally
        Numbers and throws by sector.
    """

    density: tuple[Array, Array]
    without_ricochet: tuple[Array, Array]
    completeness: Completeness
    tally: Tally

    @classmethod
    def of(
        cls, result: FlightResult, fragments: Fragments, *, ground: float | HeightMap = 0.0,
        gravity: float = STANDARD_GRAVITY,
    ) -> FlightCounts:  # fmt: skip
        """Count a flight of fragments over a ground, by what it counted near the ground.

        Raises
        ------
        InputError
            The flight did not count near the ground.
        """
        density, short = density_counts(result), density_counts(result, ricochet=False)
        assert result.fluence is not None  # or there would be no counts
        cells = result.fluence.cells
        lowest = float(ground) if isinstance(ground, int | float) else float(ground.heights.min())
        return cls(
            density, short, Completeness.of(result, fragments, cells.energy, lowest=lowest, gravity=gravity),
            tally(result, cells.energy, sector_width=360.0 / cells.grid.sectors),
        )  # fmt: skip


class PooledFlights:
    """Flights of realisations, added one by one in the order of their numbers.

    Parameters
    ----------
    directions : Directions
        In which the distance is estimated.
    criteria : Criteria
        What counts as a hazard: those that were counted with.
    ricochet : bool
        Whether fragments ricochet off the ground: then there is a distance without ricochet too.

    Attributes
    ----------
    groups : DensityGroups
        Of all legs of the flights.
    completeness : Completeness
        How the flights of all fragments ended.
    """

    def __init__(self, directions: Directions, criteria: Criteria, *, ricochet: bool = True) -> None:
        self.criteria = criteria
        self.groups = DensityGroups(directions)
        self.completeness = Completeness()
        self._short = DensityGroups(directions) if ricochet else None
        self._tallies: list[Tally] = []
        self._events: list[Array] = []

    @property
    def realisations(self) -> int:
        """Number of realisations."""
        return self.groups.realisations

    def add(self, counts: FlightCounts) -> None:
        """Add the next realisation."""
        added = self.groups.add(*counts.density)
        if self._short is not None:
            self._short.add(*counts.without_ricochet)
        self.completeness += counts.completeness
        if self.realisations <= KEPT:
            self._events.append(added)
            self._tallies.append(counts.tally)

    def expected(self, *, draws: int = DRAWS, every_direction: bool = True) -> ExpectedDistance:
        """The distance by all legs of the flights; arguments as of `expected_distance`."""
        return expected_distance(self.groups, self.criteria.density, draws=draws, every_direction=every_direction)

    def hazard(self, tolerance: float = TOLERANCE) -> EnsembleHazard:
        """The hazard over all realisations; raises InputError where there is none."""
        found = self.expected()
        if self._short is not None:
            found = replace(found, without_ricochet=expected_distance(self._short, self.criteria.density))
        alone = Estimate(self.groups, self.criteria.density, draws=0, seed=0)
        events = np.array([alone.alone(one, found.distance) for one in self._events])
        counts, reason = Tally.join(self._tallies), self.completeness.reason
        return EnsembleHazard(counts, self.criteria, tolerance, found, events, reason)
