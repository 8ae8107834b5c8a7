"""Budget of the distance to be signed: inputs, number of samples, statistical error and grid.

Every contribution is the half-width of its one-sided band of 95 % above the median: of the inputs the 95 % quantile
less the median; of a normal error 1.645 standard deviations; of the grid the whole grid convergence index, a band of
95 % about a limit that lies to one side. Independent contributions at one level are added as squares, as ASME V&V 20
(2009) adds the standard uncertainties of inputs and numerics: for normal ones that is exact. The distance to be signed
is the median plus the sum, and not less than the upper bound of the nominal run.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from fragfield.studies.uncertainty.spread import Spread

__all__ = ["RULE", "budget_of"]

NORMAL_95 = 1.6448536269514722
RULE = (
    "Median over the inputs, plus the root of the sum of squares of the contributions, each the half-width of its "
    "one-sided band of 95 %; not less than the upper bound (95 %) of the run with the inputs of the case."
)


def budget_of(spread: Spread, hazard: Mapping[str, Any], convergence: Mapping[str, Any]) -> dict[str, Any]:
    """The budget.

    Parameters
    ----------
    spread : Spread
        Of the distance over the samples.
    hazard, convergence : mapping
        Of the nominal run's summary.

    Returns
    -------
    dict
        `median`, `contributions` (each `name`, `half_width` in m or None where it is not known, `share` of the sum of
        squares and `note`), `sum`, `signed` (m), `nominal`, `nominal_upper`, `governed_by` ("sum" or "nominal run"),
        `complete` (whether every contribution is known) and `rule`.
    """
    upper, nominal = hazard.get("upper"), hazard.get("distance")
    statistical = None if upper is None or nominal is None else max(float(upper) - float(nominal), 0.0)
    grid = ((convergence.get("quantities") or {}).get("hazard_distance") or {}) if convergence else {}
    width = grid.get("uncertainty")
    widths: list[tuple[str, float | None, str]] = [
        ("inputs", spread.high - spread.median, "95 % quantile less median, without statistical errors of the samples"),
        ("number of samples", NORMAL_95 * spread.high_standard_error, f"of that quantile: {spread.samples} samples"),
        ("statistical error", statistical, "upper bound less distance of the nominal run, its realisations"),
        ("grid", width, _grid_note(grid, convergence)),
    ]  # fmt: skip
    squares = sum(one**2 for _, one, _ in widths if one is not None)
    total = math.sqrt(squares)
    added = spread.median + total
    governed = upper is not None and float(upper) > added
    return {
        "median": spread.median,
        "contributions": [
            {
                "name": name,
                "half_width": one,
                "share": None if one is None or not squares else one**2 / squares,
                "note": note,
            }
            for name, one, note in widths
        ],
        "sum": total,
        "signed": float(upper) if governed and upper is not None else added,
        "nominal": nominal,
        "nominal_upper": upper,
        "governed_by": "nominal run" if governed else "sum",
        "complete": all(one is not None for _, one, _ in widths),
        "rule": RULE,
    }


def _grid_note(grid: Mapping[str, Any], convergence: Mapping[str, Any]) -> str:
    if grid.get("uncertainty") is None:
        reason = str((convergence or {}).get("reason") or "the nominal run has none")
        return f"not known, and not in the sum: {reason}"
    words = f"grid convergence index of the nominal run, {grid['kind'].replace('_', ' ')}"
    if grid["kind"] == "statistical":
        words += ": mostly statistical error, an upper limit"
    return words
