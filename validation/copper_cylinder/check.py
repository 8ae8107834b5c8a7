"""Rows of the copper cylinder test: wall speed at two displacements, by product model."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from validation.files import reference_beside
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from validation.copper_cylinder.streak import Streak

__all__ = ["MODELS", "NAME", "REFERENCE", "check"]

NAME = "copper_cylinder"
REFERENCE = reference_beside(__file__)
MODELS = ("landau", "landau_cj", "jwl")


def check(label: str, record: Streak, *, verdict: bool = True) -> list[Row]:
    """Compare one record of the wall with the test; a record that ends too early makes the comparison void.

    Parameters
    ----------
    label : what was computed: product model, cell size.
    record : displacement over time at the slit.
    verdict : whether the rows judge or only inform.
    """
    tolerance = REFERENCE["allowed"]["wall_speed"] if verdict else None
    far, needed = 1e3 * float(record.displacement.max()), 1e3 * (max(REFERENCE["displacement"]) + REFERENCE["window"])
    reach = within(NAME, f"{label}: record of the wall ends at", far, needed, math.inf, "own bound", "mm")
    if not reach.passed:
        return [reach]  # void
    return [
        reach,
        *(
            compare(
                NAME,
                f"{label}: wall speed at {1e3 * displacement:g} mm",
                record.speed_at(displacement, REFERENCE["window"]),
                measured,
                tolerance,
                REFERENCE["source"],
                "m/s",
            )
            for displacement, measured in zip(REFERENCE["displacement"], REFERENCE["wall_speed"], strict=True)
        ),
    ]
