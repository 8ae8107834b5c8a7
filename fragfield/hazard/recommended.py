"""The recommended distance: the expected distance, and what is not known of it, added up.

    recommended = expected + sqrt(quadrature^2 + randomness^2 + grid^2 + table^2 + inputs^2)

Every part beside the expected distance is the half-width of its one-sided band of 95 %. Where the expected density is
an integral, or that of weighted fragments, there is no randomness, and the quadrature is the bound of its points, some
tenths of a metre; elsewhere the randomness is the upper bound over the realisations less the expected distance. Of the
grid it is the whole grid convergence index, a band about a limit that lies to one side; of an arena table what other
laws within its groups and zones twice as wide change; of the inputs their 95 % quantile less the expected distance.
Independent contributions at one level are added as squares, as ASME V&V 20 (2009) adds the standard uncertainties of
inputs and numerics. A part that is not known is not in the sum; `not_included` says why.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

from fragfield.results.convergence import Convergence
from fragfield.results.hazard import DistanceParts, Hazard, WithoutRicochet
from fragfield.results.uncertainty import UncertaintyResult
from fragfield.results.words import PARTS

RULE = (
    "Expected distance plus the root of the sum of squares of the other parts, each the half-width of its one-sided "
    "band of 95 %."
)
_NO_GRID = "no grid convergence: "
_NOT_SAID: dict[str, Any] = {
    "not_integrated_because": "", "more_realisations": True, "ricochet": "none", "bearing_deg": None,
    "attitude": {"kind": "given", "words": "", "inclination_deg": None, "azimuth_deg": None, "base_height": None,
                 "worst_inclination_deg": None, "worst_roll_deg": None, "curve": []},
    "recommended": None, "parts": dict.fromkeys(PARTS), "not_included": {},
}  # fmt: skip


def hazard_of(headline: Mapping[str, Any]) -> Hazard:
    """What flights give, without a recommended distance yet, and without what is not said of the scene."""
    short = {"recommended": None, **headline["without_ricochet"]}
    return Hazard.of_stage({**_NOT_SAID, **headline, "without_ricochet": short})


def recommended_of(
    hazard: Hazard,
    convergence: Convergence | None,
    study: UncertaintyResult | None = None,
) -> Hazard:
    """The part `hazard` of the summary with the recommended distance, its parts, and why others are not included.

    `hazard`, `convergence`: parts of the summary; `study`: of a study of this run.
    """
    if not hazard.determined or hazard.expected is None:
        nothing = DistanceParts(**dict.fromkeys(PARTS))
        short = replace(hazard.without_ricochet, recommended=None)
        return replace(hazard, recommended=None, parts=nothing, not_included={}, without_ricochet=short)
    distance = None if study is None else study.distance
    grid, no_grid = _grid(convergence)
    parts = DistanceParts(
        expected=hazard.expected, **_statistical(hazard, hazard), grid=grid, table=hazard.table_width,
        inputs=None if distance is None else max(distance.spread.high - hazard.expected, 0.0),
    )  # fmt: skip
    reasons = {
        "grid": no_grid,
        "inputs": "no study of uncertain inputs" if study is None else "the study of uncertain inputs has no result",
    }
    if hazard.method == "realisations":
        reasons["randomness"] = "a single realisation has no bound"
    missing = {name: words for name, words in reasons.items() if getattr(parts, name) is None}
    short = hazard.without_ricochet
    if short.expected is not None:
        beside = replace(parts, expected=short.expected, **_statistical(hazard, short))
        short = replace(short, recommended=_sum(beside))
    return replace(hazard, recommended=_sum(parts), parts=parts, not_included=missing, without_ricochet=short)


def _statistical(hazard: Hazard, of: Hazard | WithoutRicochet) -> dict[str, float | None]:
    width = None if of.upper is None or of.expected is None else max(of.upper - of.expected, 0.0)
    integrated = hazard.method != "realisations"
    return {"quadrature": width if integrated else None, "randomness": None if integrated else width}


def _grid(convergence: Convergence | None) -> tuple[float | None, str]:
    """Half-width (m) by the cell size, or why it is not known."""
    found = convergence or Convergence(reason="")
    entry = (found.quantities or {}).get("expected_distance")
    if entry is not None and entry.uncertainty is not None:
        return entry.uncertainty, ""
    return None, (found.reason or "no other cell size gave a distance").removeprefix(_NO_GRID)


def _sum(parts: DistanceParts) -> float:
    widths = (parts.quadrature, parts.randomness, parts.grid, parts.table, parts.inputs)
    return (parts.expected or 0.0) + math.sqrt(sum(width**2 for width in widths if width is not None))
