"""Flights of realisations pooled: densities over all, how flights ended, and what the first realisations did alone.

A hazard distance can be determined only where all fragments that could be hazardous were followed to their end.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from flight.hazard.density.density_counts import DensityGroups, density_counts
from flight.hazard.density.expected import Estimate, expected_distance
from flight.hazard.density.sectors import Tally, tally
from flight.hazard.ensemble import EnsembleHazard
from flight.rows import Status
from flight.scene.air import STANDARD_GRAVITY

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from flight.hazard.criteria import Criteria
    from flight.hazard.density.directions import Directions
    from flight.hazard.density.distance import ExpectedDistance
    from flight.hazard.integral import Integral
    from flight.result import FlightResult
    from flight.scene.height_map import HeightMap

    Array = NDArray[np.float64]


LARGEST_MISSING = 1e-3  # of the mass that could be hazardous
_UNENDED = (Status.TIME_OUT, Status.LEFT_DOMAIN, Status.STEP_LIMIT, Status.NOT_A_NUMBER)
_WORDS = {
    Status.TIME_OUT: "ran out of time",
    Status.LEFT_DOMAIN: "left the domain",
    Status.STEP_LIMIT: "ran out of steps",
    Status.NOT_A_NUMBER: "have no path (NaN)",
}


@dataclass(frozen=True)
class Completeness:
    """Fragments of one or many realisations by how their flights ended; sums with `+`.

    A fragment could be hazardous whose kinetic energy at launch, with that of its fall from there to the lowest ground,
    is that of the criterion or more, or is NaN.
    """

    fragments: int = 0
    landed: int = 0
    stopped: int = 0
    hits: int = 0
    """Fragments, those that landed, those that an obstacle stopped, and crossings of witness surfaces."""
    possible: float = 0.0
    missing: float = 0.0
    """Mass of fragments that could be hazardous, and of those of them whose flight has not ended on the ground or at an
    obstacle (kg)."""
    ended: tuple[int, ...] = (0, 0, 0, 0)
    """Number of those missing by status: out of time, left the domain, out of steps, NaN."""

    @classmethod
    def of(
        cls, result: FlightResult, fragments: Fragments, energy: float, *, lowest: float | None = None,
        gravity: float = STANDARD_GRAVITY,
    ) -> Completeness:  # fmt: skip
        """Count one flight; hazardous from `energy` (J) on; `lowest` is the lowest ground (m), None: there is none."""
        rows, mass = result.landing, fragments.mass
        fall = np.maximum(fragments.position[:, 2] - (0.0 if lowest is None else lowest), 0.0)
        at_ground = mass * (0.5 * rows["initial_speed"] ** 2 + gravity * fall)
        could = ~(at_ground < energy)
        carried = mass if result.fluence is None or result.fluence.weights is None else mass * result.fluence.weights
        gone = [could & (rows["status"] == status) for status in _UNENDED]
        return cls(
            len(rows), int((rows["status"] == Status.LANDED).sum()), int((rows["status"] == Status.STOPPED).sum()),
            len(result.hits), float(carried[could].sum()),
            float(carried[np.logical_or.reduce(gone)].sum()),
            tuple(int(one.sum()) for one in gone),
        )  # fmt: skip

    def __add__(self, other: Completeness) -> Completeness:
        """Both together."""
        return Completeness(
            self.fragments + other.fragments, self.landed + other.landed, self.stopped + other.stopped,
            self.hits + other.hits, self.possible + other.possible, self.missing + other.missing,
            tuple(one + two for one, two in zip(self.ended, other.ended, strict=True)),
        )  # fmt: skip

    @property
    def reason(self) -> str:
        """Why no distance can be determined; empty where it can."""
        if not self.fragments:
            return "there are no fragments"
        if self.missing > LARGEST_MISSING * self.possible:
            how = ", ".join(
                f"{number} {_WORDS[status]}" for number, status in zip(self.ended, _UNENDED, strict=True) if number
            )
            return (
                f"{100.0 * self.missing / self.possible:.3g} % of the mass that could be hazardous neither landed nor "
                f"was stopped ({how}); at most {100.0 * LARGEST_MISSING:g} % is allowed"
            )
        if not self.landed:
            met = f", {self.hits} crossings of witness surfaces" if self.hits else ""
            held = f", obstacles stopped {self.stopped}" if self.stopped else ""
            return f"none of {self.fragments} fragments landed{held}{met}"
        return ""


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

    def expected(self) -> ExpectedDistance:
        """The distance by all legs of the flights."""
        return expected_distance(self.groups, self.criteria.density)

    def distance(self) -> ExpectedDistance:
        """The same with that before the first impact on the ground, where fragments ricochet."""
        short = None if self._short is None else expected_distance(self._short, self.criteria.density)
        return replace(self.expected(), without_ricochet=short)

    def hazard(self, tolerance: float = TOLERANCE, *, integral: Integral | None = None) -> EnsembleHazard:
        """The hazard over all realisations; InputError where there is none.

        The distance is that of an `integral`, where one is given.
        """
        found = self.distance() if integral is None else integral.expected()
        alone = Estimate(self.groups, self.criteria.density)
        events = np.array([alone.alone(one) for one in self._events])
        counts, reason = Tally.join(self._tallies), self.completeness.reason
        return EnsembleHazard(counts, self.criteria, tolerance, found, events, reason, integral)
