"""Hazard over many realisations: the hazard distance, and beside it what single events do.

Each realisation is one sample of what may happen, as one test is. The hazard distance is that of the expected density,
the mean over all of them (`flight.hazard.density.expected`). What single events do is the same estimate on each
realisation alone, and where its farthest fragment lands.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from flight.hazard.criteria import Criteria
    from flight.hazard.density.expected import ExpectedDistance
    from flight.hazard.density.sectors import Tally
    from flight.hazard.integral import Integral

    Array = NDArray[np.float64]


LOW, HIGH = 0.05, 0.95  # of single events


def quantiles(values: ArrayLike, levels: float | Sequence[float]) -> Array:
    """Quantiles over the first axis below which a further value lies that often (Weibull 1939); 95 %: from 19 on."""
    at = np.asarray(levels, dtype=np.float64)
    return np.asarray(np.quantile(np.asarray(values, dtype=np.float64), at, axis=0, method="weibull"))


@dataclass(frozen=True, eq=False)
class Curve:
    """Median, quantiles of 5 and 95 %, and pooled value of something by sector, shapes (s,)."""

    median: Array
    low: Array
    high: Array
    pooled: Array


@dataclass(frozen=True, eq=False, repr=False)
class EnsembleHazard:
    """Hazard over realisations; made by `flight.hazard.pool.PooledFlights`.

    Attributes
    ----------
    counts : Tally
        Numbers and throws by sector, of the n realisations that are kept.
    criteria : Criteria
        What counts as a hazard.
    tolerance : float
        Largest standard error of the hazard distance that counts as converged, as a fraction of it.
    expected : ExpectedDistance
        The hazard distance: of the expected density, over all realisations that were flown, or of the integral.
    events : (n,) float64
        The same estimate on each of the n realisations alone (m).
    undetermined : str
        Why the distance cannot be determined; empty where it can.
    integral : Integral or None
        The expected density without realisations: integrated, or from weighted fragments.
    """

    counts: Tally
    criteria: Criteria
    tolerance: float
    expected: ExpectedDistance
    events: Array
    undetermined: str = ""
    integral: Integral | None = None

    def __repr__(self) -> str:
        number = f"{self.realisations} realisation{'s' if self.realisations > 1 else ''}"
        return f"<flight.EnsembleHazard: {number}, {len(self.azimuth)} sectors, criterion {self.criteria.energy:g} J>"

    @property
    def realisations(self) -> int:
        """Number of realisations that are kept."""
        return self.counts.realisations

    @property
    def azimuth(self) -> Array:
        """Centres of the sectors (s,) in degrees."""
        return self.counts.azimuth

    @property
    def without_ricochet(self) -> ExpectedDistance | None:
        """As `expected`, of what the same flights do before the first impact on the ground."""
        return self.expected.without_ricochet

    @property
    def throw(self) -> Array:
        """Farthest last landing in every realisation (n,) in m."""
        return np.asarray(self.counts.throw.max(axis=1))

    @property
    def exceeded_throw(self) -> float:
        """Farthest last landing that one event in twenty exceeds (m): by the intensity, or over the realisations."""
        return float(quantiles(self.throw, HIGH)) if self.integral is None else self.integral.throw

    @property
    def hazardous(self) -> tuple[float, float | None]:
        """Expected number of fragments that are hazardous where they first land, and its standard error."""
        if self.integral is not None:
            return self.integral.hazardous, self.integral.hazardous_error
        counts = self.counts.hazardous.sum(axis=1)
        error = float(counts.std(ddof=1) / math.sqrt(len(counts))) if len(counts) > 1 else None
        return float(counts.mean()), error

    @cached_property
    def by_sector(self) -> dict[str, Curve]:
        """Throw and numbers by sector.

        Keys: max_throw (m; pooled: the largest), fragments, hazardous (pooled: the mean).
        """
        return {
            "max_throw": _curve(self.counts.throw, self.counts.throw.max(axis=0)),
            "fragments": _curve(self.counts.fragments, self.counts.fragments.mean(axis=0)),
            "hazardous": _curve(self.counts.hazardous, self.counts.hazardous.mean(axis=0)),
        }

    @property
    def headline(self) -> dict[str, Any]:
        """The hazard distance for summary.json (SI; azimuth in degrees).

        `expected` is that with ricochet, the larger; `without_ricochet` has the other. `single_event` is something
        else: median, 5 and 95 % of the distances of single realisations by the same estimate.
        """
        found = self.expected
        known = not self.undetermined
        median, low, high = self.single_event if self.realisations else (math.nan,) * 3
        short = self.without_ricochet or found
        return {
            "expected": found.distance if known else None,
            "upper": found.upper if known else None,
            "standard_error": found.standard_error if known else None,
            "without_ricochet": {
                "expected": short.distance if known else None,
                "upper": short.upper if known else None,
                "standard_error": short.standard_error if known else None,
            },
            "basis": found.basis,
            "direction_deg": found.direction if known else None,
            "realisations": self.realisations if self.integral is not None else found.realisations,
            "determined": known,
            "reason": self.undetermined,
            "single_event": {"median": median, "low": low, "high": high, "realisations": self.realisations}
            if known and self.realisations
            else None,
            "largest_throw": self.exceeded_throw,
            "method": "realisations" if self.integral is None else self.integral.method,
            "tolerance": self.tolerance,
            "converged": known and found.uncertainty <= self.tolerance,
            "distance_ground": found.ground if known else None,
            "distance_normal": found.normal if known else None,
            "max_bias": found.max_bias if known else None,
            "kernel_deg": found.kernel,
            "mirror_planes_deg": list(found.mirrors),
            "level": 0.95,
        }

    @property
    def single_event(self) -> tuple[float, float, float]:
        """Median, 5 and 95 % of `events` (m)."""
        low, median, high = (float(value) for value in quantiles(self.events, [LOW, 0.5, HIGH]))
        return median, low, high

    def summary(self) -> dict[str, Any]:
        """Numbers for the part `flight` of summary.json: throws and numbers of fragments of the realisations kept."""
        low, median, high = (float(value) for value in quantiles(self.throw, [LOW, 0.5, HIGH]))
        throw, numbers = self.by_sector["max_throw"], ("fragments", "hazardous")
        return {
            "max_range": median,
            "max_range_low": low,
            "max_range_high": high,
            "hazardous_fragments": float(self.by_sector["hazardous"].pooled.sum()),
            "realisations": self.realisations,
            "by_sector": [
                {
                    "azimuth_deg": float(azimuth),
                    **{name: float(self.by_sector[name].pooled[i]) for name in numbers},
                    "max_throw": float(throw.median[i]),
                    "max_throw_low": float(throw.low[i]),
                    "max_throw_high": float(throw.high[i]),
                    "max_throw_largest": float(throw.pooled[i]),
                }
                for i, azimuth in enumerate(self.azimuth)
            ],
        }


def _curve(each: NDArray[Any], pooled: NDArray[Any]) -> Curve:
    low, median, high = quantiles(each, [LOW, 0.5, HIGH])
    return Curve(median, low, high, np.asarray(pooled, dtype=np.float64))
