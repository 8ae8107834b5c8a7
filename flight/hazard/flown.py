"""The hazard distance of fragments: their realisations flown, counted near the ground, and pooled."""

from __future__ import annotations

import hashlib
import warnings
from dataclasses import replace
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from flight.arguments import require_number
from flight.errors import FlightWarning, InputError, NotDeterminedError
from flight.fluence import PolarGrid
from flight.fragments import Fragments
from flight.hazard.criteria import Criteria
from flight.hazard.density.directions import KERNEL, Directions
from flight.hazard.pool import FlightCounts, PooledFlights
from flight.scene.air import STANDARD_GRAVITY
from flight.scene.ricochet import DEFAULT, Ricochet
from fragfield_base.errors import names_allowed

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight.hazard.density.distance import ExpectedDistance
    from flight.hazard.ensemble import EnsembleHazard


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
