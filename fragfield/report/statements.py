"""Standing statements: what the method covers, and what a result may and may not be used for."""

from __future__ import annotations

__all__ = ["LIMITS", "MAY_BE_USED_FOR", "MUST_NOT_BE_USED_FOR", "SUMMARY_TERMS"]

SUMMARY_TERMS = (
    "The hazard distance is where the expected density of fragments of {energy:.3g} J or more falls below one per "
    "{area:.1f} m² for the last time: the mean over realisations of the random break-up, on the ground or normal to "
    "the paths below a person's height, whichever reaches farther. Its upper bound lies beyond the model's true value "
    "with a confidence of 95 % (bootstrap over the realisations); it covers the randomness of the break-up, not the "
    "uncertainty of inputs and models. Distances count from the origin that the case gives."
)

LIMITS = (
    (
        "Fragments of the casings only: no blast, heat or ground shock, no debris of buildings, vehicles or soil, no "
        "secondary fragments."
    ),
    (
        "Every round is assumed to detonate as the case says; whether and when neighbours are initiated is an input, "
        "or follows from the threshold of pressure and time that the case gives."
    ),
    (
        "Casings of neighbouring rounds can meet only while the burst is computed; from then on fragments meet each "
        "other only where the case asks for it (flight.collisions), as spheres and in the first metres."
    ),
    (
        "Detonation is a prescribed burn; burning, deflagration and partial reactions throw fewer, heavier pieces "
        "and are not covered."
    ),
    (
        "Natural break-up after a statistical law: single fragments are not predicted. Numbers and masses rest on "
        "calibrated inputs."
    ),
    "Flight is that of tumbling fragments with a mean presented area and drag; one that flies edge-on goes farther.",
    "Ground, wind and air are those of the case; walls, barricades and vegetation count only where the case has them.",
    (
        "The burst's final speed depends most on the leakage radius (burst.leakage.radius_ratio) and on the cell size: "
        "vary both before a decision rests on them."
    ),
)

MAY_BE_USED_FOR = (
    "estimating how far, how densely and how fast fragments of stored, handled or tested cased charges fly",
    "comparing arrangements, fills and separations with each other",
    "planning trials and supporting, with test data, the review of a safety case by qualified persons",
)

MUST_NOT_BE_USED_FOR = (
    "replacing the quantity-distances that the competent authority prescribes, or its approval",
    "reducing a distance on the strength of one run, without bands, grid convergence and comparison with tests",
    "rating or improving the effect of a munition on a target, for which this program has no function",
)
