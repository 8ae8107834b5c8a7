"""Hazard over the realisations of one break-up: bands of distances, and whether there are enough realisations.

A distance is given three ways. The median and the band of 5 to 95 % of the realisations show what single events do.
The pooled one is that of the mean density over all realisations, the quantity that the criterion of one hazardous
fragment per 55.7 m2 is about (a test of several rounds is pooled alike). In narrow sectors single fragments decide, so
that the worst sector of a realisation lies farther out than the worst of the pooled densities.

How well the number of realisations fixes a distance is estimated by the bootstrap (Efron 1979): realisations are drawn
again with replacement, and the spread of the median and of the pooled distance over such draws is their standard
error. Beside it stands the difference between the two halves of the ensemble.
"""

from __future__ import annotations

import math
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError
from flight.hazard.assessment import Hazard, distances_through, hazard_of, hit_probability
from flight.hazard.bands import DRAWS, HIGH, LOW, Band, Curve, band_of, bootstrap_draws, curve_of
from flight.hazard.criteria import Criteria
from flight.hazard.density.tally import Tally
from flight.hazard.distances import DISTANCES

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight.hazard.density.distance import ExpectedDistance

__all__ = ["EnsembleHazard", "assess_ensemble"]


@dataclass(frozen=True, eq=False, repr=False)
class EnsembleHazard:
    """Hazard over n realisations; made by `assess_ensemble`.

    Attributes
    ----------
    counts : Tally
        What landed where, by realisation.
    criteria : Criteria
        What counts as a hazard.
    tolerance : float
        Largest standard error of a distance that counts as converged, as a fraction of the distance.
    pooled : Hazard
        Of the mean densities.
    expected : ExpectedDistance, optional
        The hazard distance: of the expected density, over all realisations that were flown.
    undetermined : str
        Why it cannot be determined; empty where it can.
    without_ricochet : ExpectedDistance, optional
        As `expected`, of what the same flights do before the first impact on the ground.
    """

    counts: Tally
    criteria: Criteria
    tolerance: float
    pooled: Hazard
    expected: ExpectedDistance | None = None
    undetermined: str = ""
    without_ricochet: ExpectedDistance | None = None

    def __repr__(self) -> str:
        number = f"{self.realisations} realisation{'s' if self.realisations > 1 else ''}"
        reach = f"{len(self.azimuth)} sectors to {self.pooled.edges[-1]:.4g} m"
        return f"<flight.EnsembleHazard: {number}, {reach}, criterion {self.criteria.energy:g} J>"

    @property
    def realisations(self) -> int:
        """Number of realisations."""
        return self.counts.realisations

    @property
    def azimuth(self) -> NDArray[np.float64]:
        """Centres of the sectors (s,) in degrees."""
        return self.counts.azimuth

    @property
    def distance(self) -> NDArray[np.float64]:
        """Centres of the distance cells (r,) in m."""
        return self.pooled.distance

    @cached_property
    def ground_density(self) -> NDArray[np.float64]:
        """Hazardous fragments per area of ground (n, s, r) in 1/m2."""
        return np.asarray(self.counts.landings / self.counts.area)

    @cached_property
    def normal_density(self) -> NDArray[np.float64]:
        """Hazardous fragments per area normal to their paths (n, s, r) in 1/m2."""
        return np.asarray(self.counts.tracks / self.counts.area)

    @cached_property
    def sector_distance(self) -> dict[str, NDArray[np.float64]]:
        """Hazardous fragment distance by "ground" and "normal" density of every realisation and sector (n, s) in m."""
        return {"ground": self._through(self.ground_density), "normal": self._through(self.normal_density)}

    @cached_property
    def each(self) -> dict[str, NDArray[np.float64]]:
        """Every one of `DISTANCES` in every realisation (n,) in m."""
        return self._overall(self.ground_density, self.normal_density) | {"max_range": self.counts.throw.max(axis=1)}

    @cached_property
    def bands(self) -> dict[str, Band]:
        """Band of every one of `DISTANCES`."""
        pooled = self._overall(self.pooled.ground_density[None], self.pooled.normal_density[None])
        together = self._pooled_draws()
        found = {
            name: band_of(self.each[name], float(pooled[name][0]), together[name], self.tolerance) for name in pooled
        }
        throw = self.each["max_range"]
        return found | {"max_range": band_of(throw, float(throw.max()), None, self.tolerance)}

    @property
    def not_converged(self) -> tuple[str, ...]:
        """Those of `DISTANCES` whose band has not converged."""
        return tuple(name for name, band in self.bands.items() if not band.converged)

    @cached_property
    def by_sector(self) -> dict[str, Curve]:
        """Distances, throw and numbers by sector.

        Keys: hazardous_fragment_distance (the larger of both densities), ..._ground, ..._normal, max_throw (m; pooled:
        the largest), fragments, hazardous (pooled: the mean).
        """
        ground, normal = self.sector_distance["ground"], self.sector_distance["normal"]
        pooled = self.pooled
        larger = np.maximum(pooled.ground_distance, pooled.normal_distance)
        return {
            "hazardous_fragment_distance": curve_of(np.maximum(ground, normal), larger),
            "hazardous_fragment_distance_ground": curve_of(ground, pooled.ground_distance),
            "hazardous_fragment_distance_normal": curve_of(normal, pooled.normal_distance),
            "max_throw": curve_of(self.counts.throw, pooled.max_throw),
            "fragments": curve_of(self.counts.fragments, pooled.fragments),
            "hazardous": curve_of(self.counts.hazardous, pooled.hazardous),
        }

    @cached_property
    def by_distance(self) -> dict[str, Curve]:
        """Densities (1/m2) and probability of a hit on a person by distance.

        Keys: ground_density, normal_density and probability over all azimuths (pooled: the mean), and
        worst_ground_density, worst_normal_density, worst_probability in the densest sector at that distance. The
        probability comes from the density normal to the path.
        """
        found = {}
        for name, each, mean in (
            ("ground", self.ground_density, self.pooled.ground_density),
            ("normal", self.normal_density, self.pooled.normal_density),
        ):
            found[f"{name}_density"] = curve_of(each.mean(axis=1), mean.mean(axis=0))
            found[f"worst_{name}_density"] = curve_of(each.max(axis=1), mean.max(axis=0))
        area = self.criteria.person_area
        for prefix in ("", "worst_"):
            normal = self.normal_density.max(axis=1) if prefix else self.normal_density.mean(axis=1)
            probability = hit_probability(normal, area)
            found[f"{prefix}probability"] = curve_of(probability, probability.mean(axis=0))
        return found

    @cached_property
    def sectors_not_converged(self) -> int:
        """Sectors in which the standard error of the pooled hazardous fragment distance exceeds the tolerance."""
        if self.realisations < 2:
            return int(self.counts.throw.shape[1])
        error = self._sector_draws.std(axis=0, ddof=1)
        pooled = self.by_sector["hazardous_fragment_distance"].pooled
        return int((error > self.tolerance * np.maximum(pooled, float(self.counts.edges[1]))).sum())

    @property
    def headline(self) -> dict[str, Any] | None:
        """The hazard distance for summary.json (SI; azimuth in degrees); None where it was not estimated.

        `expected` is that with ricochet, the larger; `without_ricochet` has the other. `single_event` is something
        else: median, 5 and 95 % of the distances at which the density of single realisations over all azimuths, or in
        the same direction, falls below the limit.
        """
        found = self.expected
        if found is None:
            return None
        known = not self.undetermined
        median, low, high = self.single_event
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
            "realisations": found.realisations,
            "determined": known,
            "reason": self.undetermined,
            "single_event": {"median": median, "low": low, "high": high} if known else None,
            "largest_throw": float(self.counts.throw.max()),
            "tolerance": self.tolerance,
            "converged": known and found.uncertainty <= self.tolerance,
            "distance_ground": found.ground if known else None,
            "distance_normal": found.normal if known else None,
            "max_bias": found.max_bias if known else None,
            "kernel_deg": found.kernel,
            "mirror_planes_deg": list(found.mirrors),
            "level": 0.95,
        }

    @cached_property
    def single_event(self) -> tuple[float, float, float]:
        """Median, 5 and 95 % of the realisations' own distances (m) over all azimuths or in the worst direction.

        Of the realisations whose counts are kept; in the worst direction in the sector that holds it.
        """
        if self.expected is None or self.expected.direction is None:
            each = self.each["hazardous_fragment_distance_all_round"]
        else:
            sectors = self.counts.throw.shape[1]
            sector = round(self.expected.direction / 360.0 * sectors) % sectors
            each = np.maximum(*(self.sector_distance[kind][:, sector] for kind in ("ground", "normal")))
        low, median, high = (float(value) for value in np.quantile(each, [LOW, 0.5, HIGH]))
        return median, low, high

    def summary(self) -> dict[str, Any]:
        """Numbers for summary.json: medians under the names of one realisation's, and "bands" beside them."""
        sectors = self.by_sector
        rows = [
            {
                "azimuth_deg": float(azimuth),
                **{
                    name: float(curve.pooled[i] if name in ("fragments", "hazardous") else curve.median[i])
                    for name, curve in sectors.items()
                },
                "bands": {
                    name: {key: float(values[i]) for key, values in vars(curve).items()}
                    for name, curve in sectors.items()
                    if name in ("hazardous_fragment_distance", "max_throw")
                },
            }
            for i, azimuth in enumerate(self.azimuth)
        ]
        return {
            **{name: band.median for name, band in self.bands.items()},
            "hazardous_fragments": float(self.pooled.hazardous.sum()),
            "realisations": self.realisations,
            "tolerance": self.tolerance,
            "converged": not self.not_converged,
            "not_converged": list(self.not_converged),
            "sectors_not_converged": self.sectors_not_converged,
            "bands": {name: asdict(band) for name, band in self.bands.items()},
            "by_sector": rows,
        }

    def _through(self, density: NDArray[np.float64]) -> NDArray[np.float64]:
        return distances_through(self.distance, density, self.criteria.density, float(self.counts.edges[-1]))

    def _overall(self, ground: NDArray[np.float64], normal: NDArray[np.float64]) -> dict[str, NDArray[np.float64]]:
        """Hazardous fragment distances over all sectors (k,) of densities (k, s, r)."""
        worst = [self._through(density).max(axis=1) for density in (ground, normal)]
        mean = [self._through(density.mean(axis=1)) for density in (ground, normal)]
        name = "hazardous_fragment_distance"
        return {
            name: np.maximum(*worst),
            f"{name}_ground": worst[0],
            f"{name}_normal": worst[1],
            f"{name}_all_round": np.maximum(*mean),
            f"{name}_all_round_ground": mean[0],
            f"{name}_all_round_normal": mean[1],
        }

    @cached_property
    def _drawn_densities(self) -> list[NDArray[np.float64]]:
        """Mean densities (DRAWS, s, r) of the bootstrap's draws, on the ground and normal to the path."""
        n = self.realisations
        weight = np.zeros((DRAWS, n))
        np.add.at(weight, (np.arange(DRAWS)[:, None], bootstrap_draws(n)), 1.0 / n)
        return [
            (weight @ density.reshape(n, -1)).reshape(DRAWS, *density.shape[1:])
            for density in (self.ground_density, self.normal_density)
        ]

    @cached_property
    def _sector_draws(self) -> NDArray[np.float64]:
        return np.maximum(*(self._through(density) for density in self._drawn_densities))

    def _pooled_draws(self) -> dict[str, NDArray[np.float64] | None]:
        if self.realisations < 2:
            return dict.fromkeys(DISTANCES)
        return dict(self._overall(*self._drawn_densities))


def assess_ensemble(
    counts: Tally | Sequence[Tally], criteria: Criteria | None = None, *, tolerance: float = 0.05,
    expected: ExpectedDistance | None = None, undetermined: str = "", without_ricochet: ExpectedDistance | None = None,
) -> EnsembleHazard:  # fmt: skip
    """Hazard over many realisations.

    Parameters
    ----------
    counts : Tally or sequence of Tally
        `flight.hazard.density.tally.tally` of every realisation, with the same sectors and distance cells.
    criteria : Criteria, optional
        Those that were counted with.
    tolerance : float
        Largest standard error of a distance that counts as converged, as a fraction of the distance.
    expected, undetermined, without_ricochet
        The hazard distance, why it cannot be determined, and the distance without ricochet; see `EnsembleHazard`.

    Raises
    ------
    InputError
        There is no realisation, grids differ, or the tolerance is not above zero.
    """
    require_number("hazard", "tolerance", tolerance, "")
    if not (math.isfinite(tolerance) and tolerance > 0.0):
        raise InputError(f"hazard: tolerance is {tolerance}, needed: above zero, such as 0.05")
    joined = counts if isinstance(counts, Tally) else Tally.join(counts)
    criteria = criteria or Criteria()
    return EnsembleHazard(
        joined, criteria, tolerance, hazard_of(joined, criteria), expected, undetermined, without_ricochet
    )
