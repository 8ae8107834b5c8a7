"""Grid convergence of a number computed with several cell sizes: observed order, limit, uncertainty.

The procedure is that of ASME V&V 20 (2009) and of Celik et al., J. Fluids Eng. 130 (2008) 078001, after Roache,
J. Fluids Eng. 116 (1994) 405: with three sizes h1 < h2 < h3 and values that approach a limit in one direction, the
order p follows from

    (f3 - f2) / (f2 - f1) = (h3^p - h2^p) / (h2^p - h1^p),

the limit is f1 - (f2 - f1) / ((h2/h1)^p - 1), and the uncertainty of a value is 1.25 times its distance from the limit.
Where no order can be observed (two sizes, values that oscillate or diverge), the order is taken as one, the distance
from the limit by the range of the three finest values, and the safety factor is 3. Values with statistical errors are
fitted by a straight line in the cell size (least squares, after Eca and Hoekstra, J. Comput. Phys. 262 (2014) 104); the
uncertainty is 1.25 times the line's rise to the value's size and 1.96 standard errors of that rise, which are larger
where the values lie farther from the line. Of hazard distances no observed order is used: triples of sizes show 0.2 to
3.5 where the whole series is of first order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

FACTOR_OBSERVED = 1.25
"""Safety factor of Roache's index where the order was observed with three sizes."""
FACTOR_RANGE = 3.0
"""Safety factor where it was not."""
_TWO_SIDED_95 = 1.96
"""Standard errors to either side that hold 95 % of a normal distribution."""
ORDERS = (0.5, 2.0)
"""Bounds of the order that is used: above 2 no element of first degree converges, below 0.5 the limit is a guess."""

Kind = Literal["monotone", "oscillating", "diverging", "two_sizes", "statistical", "constant", "one_size"]
KINDS: dict[Kind, str] = {
    "monotone": "order observed",
    "oscillating": "oscillating",
    "diverging": "not converging",
    "two_sizes": "two sizes",
    "statistical": "within statistical error",
    "constant": "no difference",
    "one_size": "one size",
}
"""The kinds in words."""
_LARGEST_ORDER = 20.0
_SAME = 1e-12  # relative difference of values that are the same
_SIGNIFICANT = 2.0  # standard errors of a difference


@dataclass(frozen=True)
class GridConvergence:
    """What several cell sizes say of a number."""

    kind: Kind
    """"monotone" (order observed), "oscillating", "diverging", "two_sizes", "statistical" (the values differ by no more
    than two of their standard errors), "constant" (they do not differ) or "one_size"."""
    order: float | None
    """Observed order p, not clipped; only where monotone."""
    order_used: float | None
    """Order of the uncertainty: the observed one within `ORDERS`, else and of values with errors 1."""
    extrapolated: float | None
    """Limit for cells of no size; where constant, or monotone with an order of 0.5 or more and without errors."""
    uncertainty: float | None
    """Of the value with the size asked for, in its unit: the grid convergence index, half a band of about 95 %."""
    factor: float | None
    """Safety factor in it."""


def observed_order(sizes: Sequence[float], values: Sequence[float]) -> float | None:
    """Order p of the convergence of three values.

    Parameters
    ----------
    sizes : three floats
        Ascending cell sizes; their ratios need not be equal.
    values : three floats

    Returns
    -------
    float, or None where the values do not approach a limit: they oscillate or diverge. At most 20.
    """
    (h1, h2, h3), (f1, f2, f3) = sizes, values
    if f2 == f1:
        return None
    ratio = (f3 - f2) / (f2 - f1)
    if ratio <= math.log(h3 / h2) / math.log(h2 / h1):  # its value for p = 0
        return None
    low, high = 0.0, _LARGEST_ORDER
    for _ in range(200):
        middle = 0.5 * (low + high)
        # Divided by h1^p: no power overflows or vanishes.
        found = ((h3 / h1) ** middle - (h2 / h1) ** middle) / math.expm1(middle * math.log(h2 / h1))
        low, high = (middle, high) if found < ratio else (low, middle)
    return 0.5 * (low + high)


def grid_convergence(
    sizes: Sequence[float],
    values: Sequence[float],
    standard_errors: Sequence[float] | None = None,
    *,
    at: float | None = None,
) -> GridConvergence:
    """Order and limit of a value, and its uncertainty with one of the sizes.

    `sizes` (n,): different cell sizes, in any order and unit; `values` (n,): what was computed with them;
    `standard_errors` (n,): statistical errors of the values; they decide whether a trend is significant, and where it
    is not, what slope with the cell size they may hide. The error of the value itself is not part of `uncertainty`;
    `at`: cell size whose value's uncertainty is asked for; left out: the smallest. Raises ValueError: sizes that are
    not positive or not different, numbers that are not finite, or lengths that differ.
    """
    h, f = np.asarray(sizes, dtype=float), np.asarray(values, dtype=float)
    errors = np.zeros(len(h)) if standard_errors is None else np.asarray(standard_errors, dtype=float)
    if h.shape != f.shape or h.shape != errors.shape or h.ndim != 1 or not len(h):
        raise ValueError("sizes, values and standard errors need the same length, at least one")
    if not (np.isfinite(h).all() and np.isfinite(f).all() and np.isfinite(errors).all() and (h > 0.0).all()):
        raise ValueError("sizes must be positive, values and standard errors finite")
    order = np.argsort(h)
    h, f, errors = h[order], f[order], errors[order]
    if (np.diff(h) <= 0.0).any():
        raise ValueError("cell sizes must differ")
    scale_of_size = 1.0 if at is None else at / float(h[0])
    if len(h) == 1:
        return GridConvergence("one_size", None, None, None, None, None)
    scale: float = float(np.abs(f).max()) + float(np.finfo(float).tiny)
    if float(np.ptp(f)) <= _SAME * scale:
        return GridConvergence("constant", None, None, float(f[0]), 0.0, FACTOR_OBSERVED)
    finest = slice(1, 3)  # coarser ones are farther from the range of convergence
    differences, of_difference = np.abs(f[finest] - f[0]), np.hypot(errors[finest], errors[0])
    known = bool((of_difference > 0.0).any())
    if known and (differences <= _SIGNIFICANT * of_difference).all():
        return _by_line("statistical", h, f, errors, scale_of_size)
    every, (h, f) = (h, f, errors), (h[:3], f[:3])
    if len(h) == 2:
        return _by_range("two_sizes", h, f, scale_of_size)
    oscillating = (f[2] - f[1]) * (f[1] - f[0]) < 0.0
    p = None if oscillating else observed_order(h.tolist(), f.tolist())
    if p is None:
        kind: Kind = "oscillating" if oscillating else "diverging"
        return _by_line(kind, *every, scale_of_size) if known else _by_range(kind, h, f, scale_of_size)
    if known:
        return replace(_by_line("monotone", *every, scale_of_size), order=p)
    used = float(np.clip(p, *ORDERS))
    beyond = float((f[1] - f[0]) / ((h[1] / h[0]) ** used - 1.0))
    error = abs(beyond) * float(scale_of_size**used)
    limit = float(f[0]) - beyond if p >= ORDERS[0] else None
    return GridConvergence("monotone", p, used, limit, FACTOR_OBSERVED * error, FACTOR_OBSERVED)


def _by_line(
    kind: Kind,
    h: NDArray[np.float64],
    f: NDArray[np.float64],
    errors: NDArray[np.float64],
    scale_of_size: float,
) -> GridConvergence:
    """First order by a straight line through all values, with the rise that their errors may hide.

    The errors are multiplied by the root of chi squared per degree of freedom where that is above 1 (Birge's ratio).
    """
    size = scale_of_size * float(h[0])
    away = h - h.mean()
    weights = away / np.sum(away**2)  # of the values in the line's slope
    slope = float(weights @ f)
    of_slope = float(np.sqrt(np.sum((weights * errors) ** 2)))
    if len(h) > 2:
        left = f - f.mean() - slope * away
        variance = float(np.mean(errors**2))
        of_slope *= max(1.0, math.sqrt(float(left @ left) / variance / (len(h) - 2)))
    uncertainty = (FACTOR_OBSERVED * abs(slope) + _TWO_SIDED_95 * of_slope) * size
    return GridConvergence(kind, None, 1.0, None, uncertainty, FACTOR_OBSERVED)


def _by_range(kind: Kind, h: NDArray[np.float64], f: NDArray[np.float64], scale_of_size: float) -> GridConvergence:
    """First order through the range of the values."""
    beyond = scale_of_size * float(np.ptp(f)) / (float(h[-1] / h[0]) - 1.0)
    return GridConvergence(kind, None, 1.0, None, FACTOR_RANGE * beyond, FACTOR_RANGE)
