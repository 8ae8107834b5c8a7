"""Rows of the attitudes: every cell size against the finest, the spread over leans, and the envelope."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from validation.files import reference_beside
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["NAME", "REFERENCE", "check_cells", "check_envelope", "check_lean"]

NAME = "attitudes"
REFERENCE = reference_beside(__file__)
_SOURCE = REFERENCE["source"]


def check_cells(fill: str, hazards: Mapping[str, Mapping[str, Any]]) -> list[Row]:
    """Distances by cell size, each two of them apart in standard errors of their difference."""
    rows = [_inform(f"{fill}, {size}: distance, upright", hazard) for size, hazard in hazards.items()]
    apart = {
        (one, other): abs(a["expected"] - b["expected"]) / np.hypot(a["standard_error"], b["standard_error"])
        for (one, a), (other, b) in combinations(hazards.items(), 2)
    }
    if apart:
        (one, other), worst = max(apart.items(), key=lambda item: item[1])
        quantity = f"{fill}: distances of {one} and {other}, the two farthest apart in standard errors"
        rows.append(within(NAME, quantity, float(worst), 0.0, REFERENCE["cells"]["standard_errors"], _SOURCE))
    return rows


def check_lean(fill: str, hazards: Mapping[float, Mapping[str, Any]]) -> list[Row]:
    """Distances in the worst direction over leans of a few degrees."""
    rows = [_inform(f"{fill}: distance, leaning {lean:g} degrees", hazard) for lean, hazard in hazards.items()]
    values = [hazard["expected"] for hazard in hazards.values()]
    quantity = f"{fill}: largest over smallest distance over the leans, less one"
    return [*rows, within(NAME, quantity, max(values) / min(values) - 1.0, 0.0, REFERENCE["lean"]["allowed"], _SOURCE)]


def check_envelope(fill: str, attitude: Mapping[str, Any]) -> list[Row]:
    """The worst attitude of the envelope, and the distance upright, lying and nose down."""
    rows = []
    curve = {row["inclination_deg"]: row for row in attitude["curve"]}
    worst = curve[attitude["worst_inclination_deg"]]
    rows.append(
        _inform(f"{fill}: envelope, worst at {attitude['worst_inclination_deg']:g} degrees from upright", worst)
    )
    for degrees, words in ((0.0, "upright"), (90.0, "lying"), (180.0, "nose down")):
        rows.append(compare(NAME, f"{fill}: {words}, against the worst", curve[degrees]["expected"], worst["expected"],
                            None, _SOURCE, "m"))  # fmt: skip
    return rows


def _inform(quantity: str, hazard: Mapping[str, Any]) -> Row:
    words = f"{quantity} (standard error {hazard['standard_error']:.1f} m)"
    return Row(NAME, words, hazard["expected"], None, None, None, None, _SOURCE, "m")
