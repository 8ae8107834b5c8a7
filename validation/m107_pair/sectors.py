"""Hits on the ring by their angle from the focus: numbers, masses and speeds, with standard errors.

The pair stands along x, so that its focus lies at 90 and 270 degrees and all four quadrants are alike: an angle from
the focus, 0 to 90 degrees, stands for four azimuths. Every realisation gives one value a sector.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from validation.paper_3_2.ratios import Estimate, mean_of, number_ratio, peaks, sector

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from validation.ensembles import RingEnsemble

__all__ = ["BINS", "LOBE", "SECTORS", "UNITS", "Key", "fast_speed", "focus", "profile", "reading", "scatter"]

Key = tuple[str, str]
"""Kind of a quantity, and the sector that it belongs to."""

LOBE = 60.0
"""Degrees from the focus beyond which the pair is undisturbed."""
SECTORS = {f"within {width:g} deg": (0.0, width) for width in (5.0, 10.0, 20.0, 35.0)}
BEYOND = f"beyond {LOBE:g} deg"
BINS = {f"{low:g} to {low + 10:g} deg": (low, low + 10.0) for low in np.arange(0.0, 90.0, 10.0)}
UNITS = {"number": "per degree", "mass": "kg per degree"}
"""Of a kind; all others are speeds."""
_SHARE = 0.99


def profile(ensemble: RingEnsemble) -> dict[Key, Estimate]:
    """Number and mass a degree in sectors and bins, mean speed and speed of 99 % of the fragments in sectors."""
    found: dict[Key, Estimate] = {}
    sectors = SECTORS | {BEYOND: (LOBE, 90.0)}
    for place, angles in (sectors | BINS).items():
        for kind in UNITS:
            found[kind, place] = mean_of(per_degree(ensemble, angles, kind))
    for place, angles in sectors.items():
        found["mean speed", place] = mean_of(mean_speed(ensemble, angles))
        found["99 % of speeds", place] = mean_of(fast_speed(ensemble, angles, _SHARE))
    return found


def focus(ensemble: RingEnsemble) -> dict[Key, Estimate]:
    """A degree of each sector over one of the undisturbed rest, and fast fragments within 5 degrees (m/s)."""
    found: dict[Key, Estimate] = {}
    for kind in UNITS:
        rest = per_degree(ensemble, (LOBE, 90.0), kind)
        for place, angles in SECTORS.items():
            found[kind, place] = _ratio(per_degree(ensemble, angles, kind), rest)
    place, angles = next(iter(SECTORS.items()))
    found["99 % of speeds", place] = mean_of(fast_speed(ensemble, angles, _SHARE))
    found["largest speed", place] = mean_of(fast_speed(ensemble, angles, 1.0))
    return found


def reading(pair: RingEnsemble, single: RingEnsemble, bins: Sequence[float]) -> dict[str, Estimate]:
    """The paper's reading: peaks of both curves in bins of these widths (degrees), and the lobe's integral (deg)."""
    ours, base = pair.every_height, single.every_height
    found = {}
    for width in bins:
        number, speed = peaks(ours, base, width)
        found[f"peak of the number, bins of {width:g} deg"] = number
        found[f"peak of the largest speed, bins of {width:g} deg"] = speed
    lobe = number_ratio(ours, base, sector(ours, LOBE))
    extent = 4.0 * LOBE  # on both sides of both directions
    integral = Estimate(extent * (lobe.value - 1.0), extent * lobe.error)
    return {**found, f"integral of the number ratio less 1, within {LOBE:g} deg": integral}


def scatter(fan: Sequence[Mapping[Key, Estimate]], key: Key) -> float:
    """Standard deviation of a quantity over bursts that should be alike, over its mean; NaN of fewer than two."""
    values = np.array([one[key].value for one in fan])
    return float(values.std(ddof=1) / values.mean()) if values.size > 1 else float("nan")


def per_degree(ensemble: RingEnsemble, angles: tuple[float, float], kind: str) -> NDArray[np.float64]:
    """Number or mass (kg) a degree of azimuth between two angles from the focus, by realisation (r,)."""
    hits = _between(ensemble, angles)
    weight = hits["mass"] if kind == "mass" else None
    total = np.bincount(hits["realisation"], weight, minlength=ensemble.fragments.size)
    return np.asarray(total / (4.0 * (angles[1] - angles[0])))


def mean_speed(ensemble: RingEnsemble, angles: tuple[float, float]) -> NDArray[np.float64]:
    """Mean initial speed of the fragments (m/s), by realisation that has any."""
    hits = _between(ensemble, angles)
    number = np.bincount(hits["realisation"])
    total = np.bincount(hits["realisation"], hits["initial_speed"])
    return np.asarray(total[number > 0] / number[number > 0])


def fast_speed(ensemble: RingEnsemble, angles: tuple[float, float], share: float) -> NDArray[np.float64]:
    """Initial speed (m/s) that a share of the fragments does not exceed (1: the largest), by realisation with any."""
    hits = _between(ensemble, angles)
    order = np.lexsort((hits["initial_speed"], hits["realisation"]))
    number = np.bincount(hits["realisation"])
    first = np.cumsum(number) - number
    rank = np.ceil(share * number - 1e-9).astype(np.int64) - 1
    return np.asarray(hits["initial_speed"][order][(first + rank)[number > 0]])


def _between(ensemble: RingEnsemble, angles: tuple[float, float]) -> NDArray[Any]:
    away = np.abs(ensemble.hits["azimuth"] % 180.0 - 90.0)
    return np.asarray(ensemble.hits[(away >= angles[0]) & (away < angles[1] + 1e-9 * (angles[1] >= 90.0))])


def _ratio(ours: NDArray[np.float64], rest: NDArray[np.float64]) -> Estimate:
    """Ratio of the means of two values a realisation, which may depend on each other; error to first order."""
    value = float(ours.mean() / rest.mean())
    return Estimate(value, mean_of(ours - value * rest).error / float(rest.mean()))
