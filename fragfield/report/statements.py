"""Standing statements: what the method covers, and what a result may and may not be used for."""

from __future__ import annotations

__all__ = ["LIMITS", "MAY_BE_USED_FOR", "MUST_NOT_BE_USED_FOR", "SUMMARY_TERMS"]

SUMMARY_TERMS = (
    "The hazardous fragment distance is the farthest distance at which fragments of {energy:.3g} J or more are as "
    "dense as one per {area:.1f} m², by area of ground or normal to their path, whichever is farther: in the worst "
    "azimuth sector, and with the density taken over all azimuths. The break-up is random and was computed several "
    "times: the distances given first are medians of these realisations, with the band that holds 5 to 95 % of them; "
    "the pooled distance is that of their mean density. Within a narrow sector single fragments decide, so that the "
    "worst sector of one realisation lies farther out than that of the mean. The largest throw is the distance of the "
    "farthest fragment, hazardous or not. Distances count from the origin that the case gives, on open, level ground."
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
