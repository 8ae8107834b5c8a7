"""Many realisations of one burst on a witness ring: numbers, masses and speeds by the angle from the focus.

A pair stands along x, so that its focus lies at 90 and 270 degrees and all four quadrants are alike: an angle from the
focus, 0 to 90 degrees, stands for four azimuths. The ring catches every fragment, whatever its height: there is no
ground, and only what never gets as far as the radius misses. Every realisation gives one value a sector; the mean over
realisations and its standard error follow from their spread.
"""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

import flight
from transition import BreakUp, Snapshot
from transition.motion import images
from validation.runs import StudyError

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

    from transition import BreakUpSettings

__all__ = ["HITS", "Estimate", "Ring", "mean_of", "ratio_of_means", "ring_of", "ring_of_run"]

RADIUS = 7.62  # m, the paper's
FLOOR = -1000.0  # m; what fell so far without reaching the ring never will
AT_ONCE = 8  # realisations that fly together

HITS = np.dtype([("realisation", "i4"), ("azimuth", "f8"), ("mass", "f8"), ("initial_speed", "f8")])
"""One hit: degrees, kg, m/s."""


@dataclass(frozen=True)
class Estimate:
    """A value with its standard error."""

    value: float
    error: float

    def over(self, other: Estimate) -> Estimate:
        """Ratio to an independent estimate, the errors taken to first order."""
        ratio = self.value / other.value
        return Estimate(ratio, math.hypot(self.error, ratio * other.error) / abs(other.value))


def mean_of(values: NDArray[np.float64]) -> Estimate:
    """Mean of one value a realisation, with its standard error; NaN of fewer than two."""
    if values.size < 2:
        return Estimate(math.nan, math.nan)
    return Estimate(float(values.mean()), float(values.std(ddof=1) / math.sqrt(values.size)))


def ratio_of_means(ours: NDArray[np.float64], base: NDArray[np.float64]) -> Estimate:
    """Ratio of the means of two values of the same realisations, which may depend on each other; to first order."""
    value = float(ours.mean() / base.mean())
    return Estimate(value, mean_of(ours - value * base).error / float(base.mean()))


@dataclass(frozen=True, eq=False)
class Ring:
    """Hits of an ensemble on the ring.

    Attributes
    ----------
    fragments : (r,) int64
        Fragments of every realisation.
    hits : (n,) structured array of dtype HITS
        The outward hits, one by one.
    """

    fragments: NDArray[np.int64]
    hits: NDArray[Any]

    def per_degree(
        self, angles: tuple[float, float], kind: Literal["number", "mass"] = "number"
    ) -> NDArray[np.float64]:
        """Number or mass (kg) a degree of azimuth between two angles from the focus, by realisation (r,)."""
        hits = self._between(angles)
        weight = hits["mass"] if kind == "mass" else None
        total = np.bincount(hits["realisation"], weight, minlength=self.fragments.size)
        return np.asarray(total / (4.0 * (angles[1] - angles[0])))

    def mean_speed(self, angles: tuple[float, float]) -> NDArray[np.float64]:
        """Mean initial speed of the fragments (m/s), by realisation that has any."""
        hits = self._between(angles)
        number = np.bincount(hits["realisation"])
        total = np.bincount(hits["realisation"], hits["initial_speed"])
        return np.asarray(total[number > 0] / number[number > 0])

    def fast_speed(self, angles: tuple[float, float], fraction: float) -> NDArray[np.float64]:
        """Initial speed (m/s) that a fraction of the fragments does not exceed (1: the largest), by realisation."""
        hits = self._between(angles)
        order = np.lexsort((hits["initial_speed"], hits["realisation"]))
        number = np.bincount(hits["realisation"])
        first = np.cumsum(number) - number
        rank = np.ceil(fraction * number - 1e-9).astype(np.int64) - 1
        return np.asarray(hits["initial_speed"][order][(first + rank)[number > 0]])

    def _between(self, angles: tuple[float, float]) -> NDArray[Any]:
        away = np.abs(self.hits["azimuth"] % 180.0 - 90.0)
        return np.asarray(self.hits[(away >= angles[0]) & (away < angles[1] + 1e-9 * (angles[1] >= 90.0))])


def ring_of(
    snapshot: Snapshot,
    settings: BreakUpSettings | None = None,
    flight_arguments: Mapping[str, Any] | None = None,
    *,
    seed: int,
    realisations: int,
    radius: float = RADIUS,
    threads: int | None = None,
) -> Ring:
    """Break one burst up again and again and fly every realisation to the ring.

    Parameters
    ----------
    snapshot : end of the burst stage; the ring stands about the origin.
    settings : choices of the break-up.
    flight_arguments : arguments of `flight.fly` for air, drag, gravity, wind and integrator; the others are the ring's.
    seed : of the ensemble. Ensembles that are compared need seeds of their own: rounds alike would otherwise break
        alike, and the errors of the two would not be independent.
    realisations : how many.
    radius : of the ring (m).
    threads : of break-up and flight; the result does not depend on it.
    """
    prepared = BreakUp(snapshot, settings)
    own = ("ground", "witnesses", "origin", "domain", "sample", "seed", "time_limit", "threads")
    arguments = {key: value for key, value in (flight_arguments or {}).items() if key not in own}
    arguments |= {"ground": None, "witnesses": [flight.Cylinder(radius, name="ring")], "threads": threads}
    domain = flight.Domain(radius=1.01 * radius, floor=FLOOR)
    sizes: list[int] = []
    hits: list[NDArray[Any]] = []
    for start in range(0, realisations, AT_ONCE):
        batch = prepared.many(seed, range(start, min(start + AT_ONCE, realisations)), threads)
        owner = np.repeat(np.arange(len(sizes), len(sizes) + len(batch)), [len(one) for one in batch])
        with warnings.catch_warnings():
            if sizes:  # what is said of the first realisations holds for all
                warnings.simplefilter("ignore", flight.FlightWarning)
            found = flight.fly(flight.Fragments.concatenate(batch), **arguments, domain=domain).hits
        outward = found[found["direction"] > 0]
        kept = np.zeros(len(outward), dtype=HITS)
        kept["realisation"] = owner[outward["fragment"]]
        for name in ("azimuth", "mass", "initial_speed"):
            kept[name] = outward[name]
        hits.append(kept)
        sizes += [len(one) for one in batch]
    return Ring(np.array(sizes, dtype=np.int64), np.concatenate(hits))


def ring_of_run(folder: Path, rounds: int, *, seed: int, realisations: int, threads: int | None = None) -> Ring:
    """`ring_of` a finished run, with the break-up, air, drag and integrator of its case.

    Raises
    ------
    StudyError
        The run has not the number of `rounds` that it should, those behind planes of symmetry included.
    """
    from fragfield.case import read_resolved
    from fragfield.case.problem import break_up_settings, flight_arguments

    snapshot = Snapshot.read(folder / "burst_snapshot.h5")
    found = len(snapshot.rounds) * (len(images(snapshot.planes)) + 1)
    if found != rounds:
        raise StudyError(f"{folder}: a burst of {found} rounds, mirrored ones included; {rounds} are needed")
    case = read_resolved(folder / "case.toml")
    return ring_of(snapshot, break_up_settings(case), flight_arguments(case), seed=seed, realisations=realisations,
                   threads=threads)  # fmt: skip
