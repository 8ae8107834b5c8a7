"""What is not known beyond the edge of a map of heights."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.case.conversion.surroundings import bearing_of, direction_words, ground_of

if TYPE_CHECKING:
    from flight.hazard.density.distance import ExpectedDistance
    from fragfield.case import Case

__all__ = ["beyond_map_words"]


def beyond_map_words(case: Case, expected: ExpectedDistance) -> str:
    """Why a distance is not determined that reaches beyond the map, where the ground is not known; else empty.

    Parameters
    ----------
    case : Case
        Resolved.
    expected : ExpectedDistance
        Of its flights.
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
