"""Pair over single round by azimuth: numbers and speeds with standard errors, sector by sector.

Every realisation gives one value a sector; the ensemble's mean and its standard error follow from their spread. The
single round is axially symmetric, so its value is the mean over all azimuths.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from validation.ring_counts import RingCounts

__all__ = [
    "FOCUS",
    "Estimate",
    "beyond",
    "fastest_ratio",
    "half_width_of",
    "integral_above_one",
    "mean_of",
    "number_by_half_width",
    "number_ratio",
    "peaks",
    "sector",
    "speed_ratio",
]

FOCUS = (90.0, 270.0)
"""Directions of the focus (degrees): perpendicular to the line of centres, which lies along x."""


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error."""

    value: float
    error: float

    def over(self, other: Estimate) -> Estimate:
        """Ratio to an independent estimate, the errors taken to first order."""
        ratio = self.value / other.value
        return Estimate(ratio, math.hypot(self.error, ratio * other.error) / abs(other.value))

    def minus(self, other: Estimate) -> Estimate:
        """Difference from an independent estimate."""
        return Estimate(self.value - other.value, math.hypot(self.error, other.error))


def sector(counts: RingCounts, half_width: float, centres: Sequence[float] = FOCUS) -> NDArray[np.bool_]:
    """Bins (b,) whose middles lie within the half-width (degrees) of one of the centres."""
    return _distance(counts, centres) < half_width


def beyond(counts: RingCounts, half_width: float, centres: Sequence[float] = FOCUS) -> NDArray[np.bool_]:
    """Bins (b,) whose middles lie farther than the half-width (degrees) from all centres."""
    return _distance(counts, centres) > half_width


def _distance(counts: RingCounts, centres: Sequence[float]) -> NDArray[np.float64]:
    away = np.abs((counts.azimuth[:, None] - np.asarray(centres) + 180.0) % 360.0 - 180.0)
    return np.asarray(away.min(axis=1))


def mean_of(values: NDArray[np.float64]) -> Estimate:
    """Mean of one value a realisation, with its standard error; NaN of fewer than two."""
    if values.size < 2:
        return Estimate(math.nan, math.nan)
    return Estimate(float(values.mean()), float(values.std(ddof=1) / math.sqrt(values.size)))


def number_ratio(pair: RingCounts, single: RingCounts, where: NDArray[np.bool_]) -> Estimate:
    """Mean hits a bin of the pair in the bins `where`, over the single round's mean over all bins."""
    return mean_of(pair.hits[:, where].mean(axis=1)).over(mean_of(single.hits.mean(axis=1)))


def speed_ratio(
    pair: RingCounts,
    single: RingCounts,
    where: NDArray[np.bool_],
    which: Literal["largest", "mean"],
    at: Literal["initial_speed", "speed"] = "initial_speed",
) -> Estimate:
    """Speed of the pair in the bins `where` over the single round's at all azimuths.

    Parameters
    ----------
    pair, single : RingCounts
        Ensembles with bins of one width, which "largest" depends on: more hits in a bin, a larger largest.
    where : (b,) bool
        Bins of the pair.
    which : "largest" or "mean"
        The mean over the bins that were hit of the largest speed in each, or the mean over all hits, by number.
    at : "initial_speed" or "speed"
        At launch, or at the ring.
    """
    everywhere = np.ones(single.hits.shape[1], dtype=bool)
    return mean_of(_speeds(pair, where, which, at)).over(mean_of(_speeds(single, everywhere, which, at)))


def _speeds(counts: RingCounts, where: NDArray[np.bool_], which: str, at: str) -> NDArray[np.float64]:
    """One speed a realisation (m/s); realisations without a hit in these bins say nothing."""
    hits = counts.hits[:, where]
    if which == "largest":
        total, number = getattr(counts, f"largest_{at}")[:, where].sum(axis=1), (hits > 0).sum(axis=1)
    else:
        total, number = getattr(counts, at)[:, where].sum(axis=1), hits.sum(axis=1)
    return np.asarray(total[number > 0] / number[number > 0])


def fastest_ratio(pair: RingCounts, single: RingCounts, half_width: float) -> Estimate:
    """Largest initial speed in a whole sector about the focus, over that in a sector as wide of the single round.

    Parameters
    ----------
    pair, single : RingCounts
        Ensembles.
    half_width : float
        Of the sector (degrees), a whole number of bins. The pair's value is the mean of both sectors, the single
        round's the mean over all places of the sector.
    """
    both = [pair.largest_initial_speed[:, sector(pair, half_width, (centre,))].max(axis=1) for centre in FOCUS]
    largest = single.largest_initial_speed
    around = largest
    for shift in range(1, round(2.0 * half_width / single.width)):
        around = np.maximum(around, np.roll(largest, -shift, axis=1))
    return mean_of(np.mean(both, axis=0)).over(mean_of(around.mean(axis=1)))


def peaks(pair: RingCounts, single: RingCounts, width: float, within: float = 20.0) -> tuple[Estimate, Estimate]:
    """The paper's reading: the highest bin of the counts' curve near the focus, and the peak of the curve of maxima.

    The paper shows one curve of counts by azimuth and one of "the maximum initial velocity of fragments with different
    azimuth angles" (section 3.2.1) and compares their peaks in the focus with the single round's.

    Parameters
    ----------
    pair, single : RingCounts
        Ensembles.
    width : float
        Of the bins (degrees).
    within : float
        Half-width (degrees) of the area about 90 and 270 degrees in which peaks are looked for.

    Returns
    -------
    Number ratio of the bin with the most hits on average, and ratio of largest initial speeds of the bin in which they
    are largest on average, both over the single round's mean over all bins of that width.
    """
    ours, base = pair.in_bins_of(width), single.in_bins_of(width)
    near = np.flatnonzero(sector(ours, within))
    fullest = near[np.argmax(ours.hits[:, near].mean(axis=0))]
    fastest = near[np.argmax(ours.largest_initial_speed[:, near].mean(axis=0))]
    everywhere = np.ones(base.hits.shape[1], dtype=bool)
    number = mean_of(ours.hits[:, fullest].astype(float)).over(mean_of(base.hits.mean(axis=1)))
    of_single = mean_of(_speeds(base, everywhere, "largest", "initial_speed"))
    return number, mean_of(ours.largest_initial_speed[:, fastest]).over(of_single)


def number_by_half_width(pair: RingCounts, single: RingCounts) -> tuple[NDArray[np.float64], list[Estimate]]:
    """Half-widths (degrees), whole bins from one bin to a right angle, and the number ratio of both sectors at each."""
    half_widths = np.arange(pair.width, 90.0 + 0.5 * pair.width, pair.width)
    return half_widths, [number_ratio(pair, single, sector(pair, float(width))) for width in half_widths]


def half_width_of(half_widths: NDArray[np.float64], ratios: Sequence[Estimate], wanted: float) -> Estimate | None:
    """The widest half-width (degrees) at which the ratio falls through `wanted`; None where it does not.

    Linear between the half-widths; the error is that of the ratio over the slope there.
    """
    values = np.array([ratio.value for ratio in ratios])
    falling = np.flatnonzero((values[:-1] >= wanted) & (values[1:] < wanted))
    if not falling.size:
        return None
    last = int(falling[-1])
    share = (values[last] - wanted) / (values[last] - values[last + 1])
    step = half_widths[last + 1] - half_widths[last]
    slope = (values[last] - values[last + 1]) / step
    return Estimate(float(half_widths[last] + share * step), float(ratios[last].error / slope))


def integral_above_one(pair: RingCounts, single: RingCounts) -> float:
    """Integral over the azimuth of the number ratio less one (degrees)."""
    ratio = pair.hits.mean(axis=0) / single.hits.mean()
    return float(((ratio - 1.0) * pair.width).sum())
