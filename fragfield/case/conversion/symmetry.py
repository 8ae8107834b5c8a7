"""Symmetries of a case that later stages use: rounds that are axisymmetric until they break up."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from fragfield.case.conversion.stack import expanded

if TYPE_CHECKING:
    from fragfield.case.schema import Case
    from fragfield.case.tables.round import RoundTable

__all__ = ["all_azimuths_alike", "is_axisymmetric"]

_PARALLEL = 1e-9  # 1 - |cosine| below which two directions are one


def is_axisymmetric(case: Case) -> bool:
    """Whether a resolved case is a single round of revolution, initiated on its axis, with nothing beside it.

    A plane across the axis (the ground below an upright round) keeps the symmetry; any other plane breaks it.
    """
    rounds = expanded(case)
    if len(rounds) != 1:
        return False
    (only,) = rounds
    if only.profile is None or only.initiation is not None:
        return False
    if any(point.offset != (0.0, 0.0) for point in only.ignition or ()):
        return False
    return all(plane.normal is not None and _parallel(plane.normal, only.axis) for plane in case.plane)


def all_azimuths_alike(case: Case) -> bool:
    """Whether every azimuth has the same expected hazard as far as the rounds go: one upright axisymmetric round."""
    return is_axisymmetric(case) and upright(expanded(case)[0])


def upright(item: RoundTable) -> bool:
    """Whether the round's axis is vertical."""
    return _parallel(item.axis, (0.0, 0.0, 1.0))


def _parallel(one: tuple[float, ...], other: tuple[float, ...]) -> bool:
    cosine = sum(a * b for a, b in zip(one, other, strict=True)) / (math.hypot(*one) * math.hypot(*other))
    return 1.0 - abs(cosine) < _PARALLEL
