"""Whether a distance is determined where the ground is known no farther; words on distances are in results/words.py."""

from __future__ import annotations

import numpy as np

from fragfield.case.conversion.surroundings import bearing_of, direction_words, ground_of
from fragfield.results.words import (
    NOT_DETERMINED,
    basis_words,
    certainty,
    margin_metres,
    metres,
    metres_and_error,
    ricochet_words,
    rounded_metres,
    single_note,
    single_words,
    source_words,
    whole_metres,
)

__all__ = [  # words, until all ask for them in results/words.py
    "NOT_DETERMINED", "basis_words", "beyond_map_words", "certainty", "margin_metres", "metres", "metres_and_error",
    "ricochet_words", "rounded_metres", "single_note", "single_words", "source_words", "whole_metres",
]  # fmt: skip

from flight.hazard.density.distance import ExpectedDistance
from fragfield.case import CaseTable


def beyond_map_words(case: CaseTable, expected: ExpectedDistance) -> str:
    """Why a distance is not determined that reaches beyond the map, where the ground is not known; else empty.

    `expected` is the distance of the flights of the resolved case.
    """
    ground = ground_of(case)
    if isinstance(ground, float):
        return ""
    reach = ground.reach(case.flight.origin, expected.azimuth)
    if expected.direction is None:  # one distance for every direction
        reach = ground.reach(case.flight.origin, np.arange(360.0)).min(keepdims=True)
    distance = np.fmax(expected.by_direction, expected.upper_by_direction)
    farthest = int(np.argmax(distance - reach))
    if not distance[farthest] > reach[farthest]:
        return ""
    turn = float(expected.azimuth[farthest])
    where = "" if expected.direction is None else f", {direction_words(turn, bearing_of(case, turn), whole=True)}"
    return (
        f"over level ground beyond the map of heights it would be {distance[farthest]:.0f} m{where}, and the map ends "
        f"{reach[farthest]:.0f} m from the rounds; take a larger map"
    )
