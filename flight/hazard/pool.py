"""Flights of realisations pooled: densities over all, how flights ended, and what the first realisations did alone.

`hazard_distance` flies fragments, counts them near the ground, and pools them.

A hazard distance can be determined only where all fragments that could be hazardous were followed to their end.
"""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from flight.arguments import require_number
from flight.errors import FlightWarning, InputError, NotDeterminedError
from flight.fluence import PolarGrid
from flight.fragments import Fragments
from flight.hazard.criteria import Criteria
from flight.hazard.density.density_counts import DensityGroups, density_counts
from flight.hazard.density.directions import KERNEL, Directions
from flight.hazard.density.expected import Estimate, ExpectedDistance, expected_distance
from flight.hazard.density.sectors import Tally, tally
from flight.hazard.ensemble import EnsembleHazard
from flight.rows import Status
from flight.scene.air import STANDARD_GRAVITY
from flight.scene.ricochet import DEFAULT, Ricochet
from fragfield_base.errors import names_allowed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight.hazard.integral import Integral
    from flight.result import FlightResult
    from flight.scene.scene import HeightMap

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
        names = self.__dataclass_fields__.keys() - {"ended"}
        sums = {name: getattr(self, name) + getattr(other, name) for name in names}
        return Completeness(**sums, ended=tuple(map(sum, zip(self.ended, other.ended, strict=True))))

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


NARROWEST = 1.0  # degrees of the kernel: cells are a quarter as wide, and their number squared is in every estimate
FEWEST = 10
"""Hazardous fragments in a direction, of all realisations together: of fewer an estimate is the kernel's own width."""
_BASES = {"worst": "worst_direction", "all": "all_azimuths"}
_PER_DEGREE = 10  # bins in which fragments are counted by azimuth


def hazard_distance(
    realisations: Fragments | Sequence[Fragments], criteria: Criteria | None = None, *,
    by: Literal["worst", "all"] = "worst", kernel: float = KERNEL, **flight_arguments: Any,
) -> ExpectedDistance:  # fmt: skip
    """Fly fragments and estimate the distance beyond which the expected density of hazardous ones stays acceptable.

    With the defaults it is the distance that the command `fragfield fly` gives for the same fragments.

    Parameters
    ----------
    realisations : Fragments or sequence of Fragments
        Of one event, or of several independent ones: of one there is no bound.
    criteria : flight.hazard.Criteria, optional
        Default: 79 J, 1 per 55.7 m2, a person of 1.8 m.
    by : "worst" or "all"
        The distance in its worst direction, or over all azimuths: of one upright round of revolution, whose directions
        are alike.
    kernel : float
        Half-width of the raised cosine that smooths the density over azimuth (degrees); by "worst" alone.
    **flight_arguments
        Of `flight.fly`, with its defaults (ricochet off "soft_soil"), but `contact`: by default that between fragments
        of different rounds.

    Returns
    -------
    ExpectedDistance
        `distance`, `upper`, `standard_error`, `direction`, the curve of the density, and all of it `without_ricochet`.

    Raises
    ------
    InputError
        There are no fragments, or an argument is out of range.
    NotDeterminedError
        Fragments were not followed to the ground, none landed, or in the direction that decides there are fewer than
        ten hazardous ones.
    """
    pool, hazardous = _fly(realisations, criteria, by, kernel, flight_arguments)
    reason = pool.completeness.reason
    if not reason:
        found = pool.distance()
        reason = _too_few(found, hazardous)
    if reason:
        raise NotDeterminedError(f"hazard_distance: not determined: {reason}")
    return found


def ensemble_hazard(
    realisations: Fragments | Sequence[Fragments], criteria: Criteria | None = None, *,
    by: Literal["worst", "all"] = "worst", kernel: float = KERNEL, **flight_arguments: Any,
) -> EnsembleHazard:  # fmt: skip
    """The hazard over realisations with single events and throws; arguments as of `hazard_distance`.

    A distance that is not determined is no error: `undetermined` says why.
    """
    pool, hazardous = _fly(realisations, criteria, by, kernel, flight_arguments)
    found = pool.hazard()
    return replace(found, undetermined=found.undetermined or _too_few(found.expected, hazardous))


def _fly(
    realisations: Fragments | Sequence[Fragments], criteria: Criteria | None, by: str, kernel: float,
    flight_arguments: dict[str, Any],
) -> tuple[PooledFlights, NDArray[np.int64]]:  # fmt: skip
    """All realisations flown, and numbers of fragments that are hazardous at launch by azimuth of their landing."""
    from flight.integrate.contact import Contact
    from flight.integrate.fly import fly

    events = [realisations] if isinstance(realisations, Fragments) else realisations
    arguments: dict[str, Any] = {"contact": Contact(between="rounds"), "ground": 0.0, **flight_arguments}
    _check(events, by, kernel, arguments)
    criteria = criteria or Criteria()
    grid = PolarGrid.of(kernel=kernel)
    cells = criteria.fluence_grid(grid)
    ricochet = Ricochet.of(arguments.get("ricochet", DEFAULT)) is not None
    seen: set[bytes] = set()
    hazardous = np.zeros(360 * _PER_DEGREE, dtype=np.int64)
    pool = PooledFlights(Directions(grid, _BASES[by], kernel), criteria, ricochet=ricochet)
    with warnings.catch_warnings():
        for fragments in events:
            if not isinstance(fragments, Fragments):
                raise InputError(f"hazard_distance: found {type(fragments).__name__} among the realisations; {_NEEDED}")
            _check_new(fragments, seen)
            result = fly(fragments, **arguments, fluence=cells)
            gravity = arguments.get("gravity", STANDARD_GRAVITY)
            pool.add(FlightCounts.of(result, fragments, ground=arguments["ground"], gravity=gravity))
            rows = result.landing[0.5 * fragments.mass * fragments.speed**2 >= criteria.energy]
            bins = (rows["azimuth"] * _PER_DEGREE).astype(np.int64) % len(hazardous)
            hazardous += np.bincount(bins, minlength=len(hazardous))
            warnings.simplefilter("ignore", FlightWarning)  # reported for the first
    return pool, hazardous


def _too_few(found: ExpectedDistance, hazardous: NDArray[np.int64]) -> str:
    """Why so few fragments determine no distance; empty where they do, or where none is hazardous."""
    number = int(hazardous.sum())
    if found.direction is not None and found.kernel is not None and found.kernel < 180.0:
        gap = np.arange(len(hazardous)) / _PER_DEGREE - found.direction
        here = int(hazardous[np.abs((gap + 180.0) % 360.0 - 180.0) <= found.kernel].sum())
        # several realisations show which directions are alike, and those are estimated together
        alike = number * found.kernel / 180.0 if found.realisations > 1 else 0.0
        if here < FEWEST <= number and alike < FEWEST:
            return (
                f"{here} of {number} hazardous fragments within {found.kernel:g} degrees of the worst direction; "
                f'needed: {FEWEST} or more, a wider kernel, or by="all" where all directions are alike'
            )
    if 0 < number < FEWEST:
        return f"{number} hazardous fragments in {found.realisations} realisations; needed: {FEWEST} or more"
    return ""


def _check_new(fragments: Fragments, seen: set[bytes]) -> None:
    """Refuse a set that was flown before: equal sets would give a bound without scatter."""
    key = hashlib.sha256(b"".join(np.ascontiguousarray(one).tobytes() for one in
                                  (fragments.mass, fragments.position, fragments.velocity))).digest()  # fmt: skip
    if key in seen:
        raise InputError(
            f"hazard_distance: realisation {len(seen)} has the fragments of another one; needed: independent events"
        )
    seen.add(key)


_NEEDED = "needed: flight.Fragments, or a sequence of them"


def _check(events: Sequence[Fragments], by: str, kernel: float, arguments: dict[str, Any]) -> None:
    """Refuse what a hazard distance cannot be estimated of."""
    if not hasattr(events, "__len__"):
        raise InputError(f"hazard_distance: realisations is a {type(events).__name__}; {_NEEDED}")
    if not len(events):
        raise InputError("hazard_distance: there are no realisations; needed: one or more")
    if by not in _BASES:
        raise InputError(f"hazard_distance: by is {by!r}{names_allowed(by, _BASES)}")
    require_number("hazard_distance", "kernel", kernel, "degrees", low=NARROWEST, high=180.0)
    if "fluence" in arguments:
        raise InputError("hazard_distance: fluence is its own; give criteria and kernel")
    if arguments["ground"] is None:
        raise InputError("hazard_distance: ground is None; needed: a height (m), or a HeightMap")
