"""The part `hazard` of the summary: the recommended distance and what it rests on."""

from __future__ import annotations

from typing import Literal

from fragfield.results.part import Part, out


class DistanceParts(Part):
    """Parts of the recommended distance."""

    expected: float | None = out("Expected distance", "m")
    randomness: float | None = out(
        "Half-width by the finite number of realisations; null with one, and where the expected density is an integral",
        "m",
    )
    quadrature: float | None = out(
        "Half-width by the points of the expected density; null where realisations are the source", "m"
    )
    grid: float | None = out("Half-width by the cell size; null without other sizes", "m")
    table: float | None = out("Half-width by the groups and zones of an arena table; null without one", "m")
    inputs: float | None = out("95 % quantile over the inputs less the expected distance; null without a study", "m")


class WithoutRicochet(Part):
    """The same flights up to their first impact on the ground."""

    expected: float | None = out(
        "Expected, without ricochet",
        "m",
        views="sweep compare",
        name="expected_distance_without_ricochet",
        rounding="up",
        error="hazard.without_ricochet.standard_error",
    )
    upper: float | None = out("Its upper bound", "m")
    standard_error: float | None = out("Its standard error", "m")
    recommended: float | None = out(
        "Recommended, without ricochet",
        "m",
        views="sweep compare",
        name="recommended_distance_without_ricochet",
        rounding="up",
    )


class SingleEvent(Part):
    """The same estimator on each realisation alone: not the distance to keep."""

    median: float = out("Median", "m")
    low: float = out("Single events, 5 %", "m", views="sweep", name="single_event_low", rounding="nearest")
    high: float = out("Single events, 95 %", "m", views="sweep", name="single_event_high", rounding="nearest")
    realisations: int = out("Realisations of which they are")


class FlownAttitude(Part):
    """The distance of an attitude."""

    inclination_deg: float = out("Inclination", "deg")
    roll_deg: float = out("Roll", "deg")
    expected: float | None = out("Expected distance", "m")
    upper: float | None = out("Its upper bound", "m")
    standard_error: float | None = out("Its standard error", "m")
    direction_deg: float | None = out("Its direction, from the nose's azimuth", "deg")
    realisations: int = out("Realisations flown")


class Attitude(Part):
    """Attitude of the rounds."""

    kind: Literal["upright", "lying", "inclined", "several", "any", "given"] = out(
        "Kind; `given`: as in a file of fragments"
    )
    words: str = out("The same in words")
    inclination_deg: float | None = out("Nose from upright; null where rounds differ or have none", "deg")
    azimuth_deg: float | None = out("Nose from +x, counter-clockwise; null where rounds differ or have none", "deg")
    base_height: float | None = out("Lowest base over the ground", "m")
    worst_inclination_deg: float | None = out("Of `any`: inclination of the worst attitude", "deg")
    worst_roll_deg: float | None = out("Of `any`: its roll", "deg")
    worst_azimuth_deg: float | None = out("Of `any` in wind: the azimuth of its nose", "deg", default=None)
    curve: tuple[FlownAttitude, ...] = out("Of `any`: distance by attitude")


class Recommended(Part):
    """The recommended distance with its parts."""

    recommended: float | None = out(
        "Recommended distance",
        "m",
        note="Null where not determined",
        views="sweep compare",
        name="recommended_distance",
        rounding="up",
    )
    parts: DistanceParts
    not_included: dict[str, str] = out("Why a part is not known, by its name")


class Hazard(Recommended):
    """The recommended distance, and what it rests on."""

    method: Literal["integral", "weighted_fragments", "realisations"] = out(
        "How the expected density was found: by an integral, from flights of weighted fragments, or as the mean over "
        "realisations"
    )
    not_integrated_because: str = out("Why it was not integrated; empty where it was")
    determined: bool = out("Whether there is a distance", views="sweep")
    reason: str = out("Why there is none; empty where there is one")
    table_width: float | None = out(
        "Of an arena table: what its groups and zones leave open of the expected distance", "m", default=None
    )
    expected: float | None = out(
        "Expected distance",
        "m",
        note="Where the expected density falls to the criterion",
        views="sweep compare convergence",
        name="expected_distance",
        rounding="up",
        error="hazard.standard_error",
    )
    upper: float | None = out("Its one-sided upper bound, 95 %; null with one realisation", "m")
    standard_error: float | None = out(
        "Standard error of the expected distance",
        "m",
        note="Null with one realisation",
        views="sweep",
        name="expected_distance_standard_error",
    )
    level: float = out("Level of the bounds")
    ricochet: str = out("Kind of ground, off which fragments ricochet")
    without_ricochet: WithoutRicochet
    basis: Literal["all_azimuths", "worst_direction"] = out("What the distance holds for")
    direction_deg: float | None = out(
        "Worst direction", "deg", note="Null over all azimuths", views="sweep", name="hazard_direction_deg"
    )
    bearing_deg: float | None = out("The same as a bearing; null without `[site]`", "deg")
    kernel_deg: float | None = out("Half-width over which directions are smoothed", "deg")
    max_bias: float | None = out("Bias of taking the worst direction, taken off the distance", "m")
    realisations: int = out("Realisations flown", views="sweep")
    tolerance: float = out("`hazard.tolerance`")
    converged: bool = out("Whether the realisations are enough for it")
    more_realisations: bool = out("Whether more can be made")
    distance_ground: float | None = out("Expected distance by the density on the ground alone", "m")
    distance_normal: float | None = out("Expected distance by the density normal to the path alone", "m")
    single_event: SingleEvent | None
    largest_throw: float = out(
        "Throw exceeded in 5 % of events",
        "m",
        note="Farthest landing of an event, which one event in twenty exceeds",
        views="sweep compare",
        rounding="nearest",
    )
    attitude: Attitude
