"""Bands of distances over the realisations of an ensemble, with bootstrap standard errors."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.hazard.distances import FEWEST

if TYPE_CHECKING:
    from numpy.typing import NDArray


__all__ = ["Band", "Curve", "DRAWS", "HIGH", "LOW", "band_of", "bootstrap_draws", "curve_of"]

LOW, HIGH = 0.05, 0.95
DRAWS = 200  # of the bootstrap: the standard error itself is then known to 5 %


@dataclass(frozen=True)
class Band:
    """A distance (m) over an ensemble.

    Attributes
    ----------
    median, low, high : float
        Of the realisations: the middle one, and the quantiles of 5 and 95 %.
    pooled : float
        Of all realisations together; for a throw the largest of all.
    realisations : int
        How many.
    standard_error, pooled_standard_error : float or None
        Bootstrap standard errors of the median and of the pooled distance; None for one realisation, and for the
        largest throw, which grows with the number of realisations.
    change_between_halves : float or None
        Median of the second half less that of the first.
    converged : bool
        Whether there are `FEWEST` realisations or more, and both standard errors are within the tolerance.
    needed : int or None
        Realisations at which the standard errors would be within it, since they fall with the root of the number;
        None where one realisation cannot show.
    """

    median: float
    low: float
    high: float
    pooled: float
    realisations: int
    standard_error: float | None
    pooled_standard_error: float | None
    change_between_halves: float | None
    converged: bool
    needed: int | None


@dataclass(frozen=True, eq=False)
class Curve:
    """Median, quantiles of 5 and 95 %, and pooled value of something by sector or by distance, shapes (k,)."""

    median: NDArray[np.float64]
    low: NDArray[np.float64]
    high: NDArray[np.float64]
    pooled: NDArray[np.float64]


def band_of(
    each: NDArray[np.float64], pooled: float, pooled_draws: NDArray[np.float64] | None, tolerance: float
) -> Band:
    """Band of a distance.

    Parameters
    ----------
    each : (n,) float64
        The distance in every realisation (m), in their order.
    pooled : float
        That of all together.
    pooled_draws : (b,) float64 or None
        That of every draw of the bootstrap; None where the pooled one is not judged.
    tolerance : float
        Largest standard error as a fraction of the distance.
    """
    n = len(each)
    low, median, high = (float(value) for value in np.quantile(each, [LOW, 0.5, HIGH]))
    if n < 2:
        return Band(median, low, high, pooled, n, None, None, None, converged=False, needed=None)
    error = float(np.median(each[bootstrap_draws(n)], axis=1).std(ddof=1))
    pooled_error = None if pooled_draws is None else float(pooled_draws.std(ddof=1))
    change = float(np.median(each[n // 2 :]) - np.median(each[: n // 2]))
    excess = max(
        _over(error, median, tolerance), 0.0 if pooled_error is None else _over(pooled_error, pooled, tolerance)
    )
    needed = max(FEWEST, math.ceil(n * excess**2)) if math.isfinite(excess) else None
    return Band(
        median, low, high, pooled, n, error, pooled_error, change, converged=n >= FEWEST and excess <= 1.0,
        needed=needed,
    )  # fmt: skip


def _over(error: float, value: float, tolerance: float) -> float:
    """How many times the tolerance an error is."""
    if error == 0.0:
        return 0.0
    return error / (tolerance * value) if value > 0.0 else math.inf


def bootstrap_draws(number: int) -> NDArray[np.int64]:
    """Realisations of every draw of the bootstrap (DRAWS, number): the same for the same number."""
    return np.random.default_rng(number).integers(number, size=(DRAWS, number))


def curve_of(each: NDArray[Any], pooled: NDArray[np.float64]) -> Curve:
    """Curve of values (n, k), one row a realisation, and the pooled values (k,)."""
    low, median, high = np.quantile(each, [LOW, 0.5, HIGH], axis=0)
    return Curve(median, low, high, np.asarray(pooled, dtype=np.float64))
