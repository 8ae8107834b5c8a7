"""The parts `exposed`, `witness` and `obstacle` of the summary."""

from __future__ import annotations

from typing import Literal

from fragfield.results.part import Part, out


class Estimate(Part):
    """An expected value with its bound."""

    whole = True
    expected: float | None = out("Expected value per event, over the realisations")
    upper: float | None = out("Its one-sided upper bound, 95 %")
    standard_error: float | None = out("Its standard error; null with one realisation")


class Probability(Part):
    """A probability with its bound."""

    whole = True
    expected: float = out("Estimate")
    upper: float = out("One-sided upper bound, 95 %")


class NotStopped(Part):
    """Hazardous hits that walls and roof are not shown to stop."""

    expected: float | None = out("Expected hits")
    upper: float | None = out("Upper bound")
    standard_error: float | None = out("Standard error")
    probability: Probability = out("Probability of one")


class SiteWithoutRicochet(Part):
    """The same up to the first impact on the ground."""

    density_normal: Estimate | None = out("1/m2", "1/m2")
    density_ground: Estimate | None = out("1/m2", "1/m2")
    expected_hits: Estimate | None = out("Hits")
    probability: Probability | None = out("Probability")


class Criterion(Part):
    """What must be met."""

    quantity: Literal["density", "hits", "probability"] = out("Quantity")
    limit: float = out("Its limit (density: 1/m2)")


class ExposedSite(Part):
    """What an exposed site meets, and its verdict."""

    name: str = out("Name")
    kind: str = out("Kind: person, road, area or building")
    place: tuple[float, float] = out("Its centre", "m")
    outline: tuple[tuple[float, float], ...] = out("Corners", "m")
    distance: float = out("Distance of its nearest edge", "m")
    azimuth_deg: float = out("Direction of that edge from +x, counter-clockwise", "deg")
    bearing_deg: float | None = out("The same as a bearing; null without `[site]`", "deg")
    energy: float = out("Energy from which a hit counts", "J")
    density_normal: Estimate | None = out("Hazardous fragments per area normal to their paths", "1/m2")
    density_ground: Estimate | None = out("Hazardous fragments per area of ground; null for a building", "1/m2")
    expected_hits: Estimate | None = out("Hazardous hits per event")
    probability: Probability | None = out("Probability of a hazardous hit")
    places: int | None = out(
        "Places of the size of a person or a vehicle that the site touches, of which the worst counts"
    )
    worst_place: tuple[float, float] | None = out("Centre of the worst of them", "m")
    target_area: float | None = out("Area that is hit", "m2")
    not_stopped: NotStopped | None
    barrier: dict[str, str] | None = out("By which relations; null without wall and roof")
    worst_inclination_deg: float | None = out(
        "Of attitude `any`: inclination of its worst attitude", "deg", default=None
    )
    worst_roll_deg: float | None = out("Of attitude `any`: roll of its worst attitude", "deg", default=None)
    without_ricochet: SiteWithoutRicochet | None = None
    largest_energy: float | None = out("Largest energy of a hit on a building; null in the open", "J")
    criterion: Criterion
    realisations: int = out("Realisations flown")
    level: float = out("Level of the bounds")
    verdict: Literal["met", "not met", "not shown", "not determined"] = out(
        "`met`: the bound meets the criterion; `not met`: the estimate exceeds it; `not shown`: neither"
    )
    no_margin: str | None = out("Why there is no margin; null where there is one")
    margin: float | None = out(
        "How far the nearest edge lies beyond the line of the expected density's bound; "
        "null where `no_margin` says why, or not determined",
        "m",
    )


class WitnessSector(Part):
    """Crossings of a sector of a witness surface."""

    azimuth_deg: float = out("Centre of the sector", "deg")
    hits: int = out("Crossings")


class Witness(Part):
    """Crossings of a witness surface."""

    name: str = out("Name")
    kind: Literal["cylinder", "panel", "polygon"] = out("Kind")
    hits: int = out("Crossings before the first impact on the ground")
    by_azimuth: tuple[WitnessSector, ...] = out("By sector")


class Obstacle(Part):
    """Impacts on an obstacle."""

    name: str = out("Name")
    kind: Literal["wall", "building", "barricade"] = out("Kind")
    hits: int = out("Impacts of the first realisation")
    hazardous_hits: int = out("Of these with the criterion's energy or more")
    stopped: int = out("Fragments that were stopped")
    max_energy: float = out("Largest energy of an impact", "J")
