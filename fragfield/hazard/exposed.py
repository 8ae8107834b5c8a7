"""Exposed sites over all realisations: densities, hits and probabilities with bounds, and the verdict on each.

Bounds are one-sided at 95 % and hold for the expected value, for what the randomness of the break-up leaves open, not
for the uncertainty of inputs and models. A sum of weights of rare hits is bounded by
the gamma law of Fay and Feuer (Statistics in Medicine 16, 1997), which for equal weights is the exact Poisson bound
and holds where nothing was hit at all; its variance is the larger of the hits' own and that between realisations. A
share of realisations is bounded by Clopper and Pearson (1934). Where all azimuths are alike (one upright round of
revolution over even ground), a site in the open takes its densities from the curves over all azimuths that the hazard
distance rests on: the same expected value, known far better than by what passed at one azimuth. Of the pieces of a
road or an area the worst counts, by its estimate and, for the bound, by the largest of the pieces' bounds: that bounds
the worst site whichever it is.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from fragfield.case.conversion.exposed_sites import ExposedSite, exposed_sites_of
from fragfield.case.conversion.surroundings import bearing_of
from fragfield.hazard.verdict import criterion_of, no_margin, verdict_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight import FlightResult, Fragments
    from flight.hazard.density.distance import ExpectedDistance
    from flight.hazard.ensemble import EnsembleHazard
    from flight.scene.targets import Witness
    from fragfield.case import CaseTable


NORMAL_95 = 1.6448536269514722
LEVEL = 0.95
_SHORT = ("density_normal", "density_ground", "expected_hits", "probability")  # given without ricochet too


def sum_bound(total: float, squares: float, largest: float, level: float = LEVEL) -> float:
    """One-sided upper bound, at `level`, of the expected value of a sum of weights over independent rare events.

    `total` and `squares` are the sums of the weights and of their squares (or an estimate of the sum's variance); no
    weight is above `largest`. Fay and Feuer 1997: (v + w^2) / (y + w) times the gamma quantile of shape (y + w)^2 / (v
    + w^2).
    """
    from scipy.special import gammaincinv

    mean, variance = total + largest, squares + largest**2
    return float(variance / mean * gammaincinv(mean**2 / variance, level))


def share_bound(count: int, number: int, level: float = LEVEL) -> float:
    """One-sided upper bound of a probability that came true `count` times in `number` (Clopper and Pearson 1934)."""
    from scipy.special import betaincinv

    return 1.0 if count >= number else float(betaincinv(count + 1.0, number - count, level))


@dataclass(frozen=True, eq=False)
class ExposedPlaces:
    """The exposed sites of a case, and the witness surfaces around them."""

    sites: list[ExposedSite]
    """In the order of the case."""

    @classmethod
    def of(cls, case: CaseTable) -> ExposedPlaces:
        """Those of a resolved case."""
        return cls(exposed_sites_of(case))

    @property
    def surfaces(self) -> list[Witness]:
        """Witness surfaces of all sites."""
        from flight.hazard.exposed import surfaces_of

        return surfaces_of([prism for site in self.sites for prism in site.prisms])

    def count(self, result: FlightResult, fragments: Fragments, first: int, *, ricochet: bool = True) -> NDArray[Any]:
        """Counts of one flight (prisms,), whose witnesses from `first` on are `surfaces`, with or without ricochet."""
        from flight.hazard.exposed import count_exposed

        prisms = [prism for site in self.sites for prism in site.prisms]
        if not prisms:
            return count_exposed(result, prisms, first, fragments.position, np.zeros(0))
        with np.errstate(over="ignore"):
            speed = np.linalg.norm(fragments.velocity, axis=1)
        return count_exposed(result, prisms, first, fragments.position, speed, ricochet=ricochet)


@dataclass(eq=False)
class ExposedSums:
    """Sums of the counts over realisations, in bounded memory."""

    sites: list[ExposedSite]
    """The sites."""
    realisations: int = 0
    """How many were added."""
    _sums: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    _between: dict[str, NDArray[np.float64]] = field(default_factory=dict)
    _with_hits: NDArray[np.int64] | None = None
    _with_through: NDArray[np.int64] | None = None
    _energy: NDArray[np.float64] | None = None
    _short: ExposedSums | None = None

    def add(self, counts: NDArray[Any], short: NDArray[Any] | None = None) -> None:
        """Add the counts of one realisation (prisms,), and those without ricochet."""
        if short is not None:
            self._short = self._short or ExposedSums(self.sites)
            self._short.add(short)
        for name in counts.dtype.names or ():
            values = counts[name].astype(np.float64)
            self._sums[name] = self._sums.get(name, 0.0) + values
            self._between[name] = self._between.get(name, 0.0) + values**2
        hit, through = (counts[name] > 0 for name in ("hits", "through"))
        self._with_hits = hit.astype(np.int64) + (0 if self._with_hits is None else self._with_hits)
        self._with_through = through.astype(np.int64) + (0 if self._with_through is None else self._with_through)
        self._energy = counts["energy"] if self._energy is None else np.maximum(self._energy, counts["energy"])
        self.realisations += 1

    def _mean(self, name: str, index: int, scale: float, largest: float) -> dict[str, float | None]:
        """Expected value over realisations with bound and standard error; weights are up to `largest`, over `scale`."""
        n = self.realisations
        total, between = float(self._sums[name][index]), float(self._between[name][index])
        squares = float(self._sums[f"{name}_squares"][index]) if f"{name}_squares" in self._sums else total
        spread = n / (n - 1) * max(between - total**2 / n, 0.0) if n > 1 else 0.0
        upper = sum_bound(total, max(squares, spread), largest)
        error = math.sqrt(spread) / n / scale if n > 1 else None
        return {"expected": total / n / scale, "upper": upper / n / scale, "standard_error": error}

    def assess(self, case: CaseTable, found: EnsembleHazard, *, determined: bool = True) -> list[dict[str, Any]]:
        """Entries of summary.json, one a site (SI, degrees); `determined`: whether all flights ended."""
        entries, first = [], 0
        for site in self.sites:
            pieces = range(first, first + len(site.prisms))
            first = pieces.stop
            entries.append(self._entry(case, site, pieces, found, determined=determined))
        return entries

    def _entry(
        self, case: CaseTable, site: ExposedSite, pieces: range, found: EnsembleHazard, *, determined: bool
    ) -> dict[str, Any]:
        away = site.edge() - np.asarray(case.flight.origin)
        distance = np.hypot(away[:, 0], away[:, 1])
        nearest = int(np.argmin(distance))
        azimuth = math.degrees(math.atan2(away[nearest, 1], away[nearest, 0])) % 360.0
        values = self._values(case, site, pieces, found, found.expected)
        if self._short is not None:
            short = self._short._values(case, site, pieces, found, found.without_ricochet or found.expected)
            values["without_ricochet"] = {name: short[name] for name in _SHORT}
        quantity, limit = criterion_of(case, site)
        entry: dict[str, Any] = {
            "name": site.table.name,
            "kind": site.table.kind,
            "place": list(site.centre),
            "outline": site.outline.tolist(),
            "distance": float(distance[nearest]),
            "azimuth_deg": azimuth,
            "bearing_deg": bearing_of(case, azimuth),
            "energy": site.prisms[0].energy,
            **(values if determined else dict.fromkeys(values)),
            "largest_energy": self._largest_energy(pieces),
            "criterion": {"quantity": quantity, "limit": limit},
            "realisations": self.realisations,
            "level": LEVEL,
        }
        entry["verdict"] = verdict_of(entry) if determined else "not determined"
        entry["no_margin"] = no_margin(case, site) or None
        entry["margin"] = None if entry["no_margin"] else _margin(away, distance, found)
        return entry

    def _largest_energy(self, pieces: range) -> float | None:
        assert self._energy is not None  # a flight has been added
        return float(self._energy[pieces.start : pieces.stop].max())

    def _values(
        self, case: CaseTable, site: ExposedSite, pieces: range, found: EnsembleHazard, expected: ExpectedDistance
    ) -> dict[str, Any]:
        if site.is_building:
            return self._building(pieces[0], site)
        return self._open(case, pieces, site, None if found.undetermined else expected)

    def _open(
        self, case: CaseTable, pieces: range, site: ExposedSite, expected: ExpectedDistance | None
    ) -> dict[str, Any]:
        normal, ground = [], []
        for index, prism in zip(pieces, site.prisms, strict=True):
            normal.append(self._mean("track", index, prism.volume, prism.longest))
            ground.append(self._mean("landings", index, prism.area, 1.0))
        return self._of_densities(site, normal, ground, _all_round(case, site, expected))

    @staticmethod
    def _of_densities(
        site: ExposedSite, normal: list[dict[str, float | None]], ground: list[dict[str, float | None]],
        around: dict[str, dict[str, float | None]] | None = None,
    ) -> dict[str, Any]:  # fmt: skip
        """Values of a site in the open by the densities of its pieces, or by those over all azimuths."""
        worst = int(
            np.argmax([max(n["expected"] or 0.0, g["expected"] or 0.0) for n, g in zip(normal, ground, strict=True)])
        )
        counted = {"normal": _worst(normal), "ground": _worst(ground)}
        density = around or counted
        table = site.table
        target = site.area * getattr(table, "number", 1.0)
        hits = {key: None if value is None else value * target for key, value in density["normal"].items()}
        x, y = site.prisms[worst].corners.mean(axis=0).tolist()
        return {
            "density_normal": density["normal"],
            "density_ground": density["ground"],
            "counted": counted if around else None,
            "expected_hits": hits,
            "probability": {key: -math.expm1(-(hits[key] or 0.0)) for key in ("expected", "upper")},
            "pieces": len(site.prisms),
            "worst_place": [x, y],
            "target_area": target,
            "not_stopped": None,
            "barrier": None,
        }

    def _building(self, index: int, site: ExposedSite) -> dict[str, Any]:
        assert self._with_hits is not None  # a flight has been added
        assert self._with_through is not None
        prism, n = site.prisms[0], self.realisations
        count, through = int(self._with_hits[index]), int(self._with_through[index])
        barriers = {name: getattr(prism, name).source for name in ("wall", "roof") if getattr(prism, name) is not None}
        passed = self._mean("through", index, 1.0, 1.0)
        return {
            "density_normal": self._mean("fluence", index, 1.0, 1.0 / prism.min_shadow),
            "density_ground": None,
            "counted": None,
            "expected_hits": self._mean("hits", index, 1.0, 1.0),
            "probability": {"expected": count / n, "upper": share_bound(count, n)},
            "pieces": 1,
            "worst_place": list(site.centre),
            "target_area": None,
            "not_stopped": {**passed, "probability": {"expected": through / n, "upper": share_bound(through, n)}}
            if barriers
            else None,
            "barrier": barriers or None,
        }


def _all_round(
    case: CaseTable, site: ExposedSite, expected: ExpectedDistance | None
) -> dict[str, dict[str, float | None]] | None:
    """Densities over all azimuths, the largest over the distances of a site; None where they are not the site's.

    They are not where directions differ, where the site has an energy or a height of its own, or where too few
    fragments reach so far that a bound could be drawn from them.
    """
    from flight.hazard.density.expected import KINDS

    prism = site.prisms[0]
    usual = case.hazard.energy, case.hazard.person_height
    if expected is None or expected.direction is not None or not expected.density_high.size:
        return None
    if (prism.energy, prism.height) != usual:
        return None
    away = site.edge() - np.asarray(case.flight.origin)
    distance = np.hypot(away[:, 0], away[:, 1])
    at = np.log(np.geomspace(max(float(distance.min()), 1e-3), float(distance.max()) * (1.0 + 1e-9), 65))
    factor = student_bound(expected.groups)
    made: dict[str, dict[str, float | None]] = {}
    for kind, name in enumerate(KINDS):
        with np.errstate(divide="ignore"):
            mean, low, high = (
                np.interp(at, np.log(expected.radius), np.log(rows[kind]), right=-np.inf)
                for rows in (expected.density, expected.density_low, expected.density_high)
            )
        worst = int(np.argmax(mean))
        if not np.isfinite([mean[worst], low[worst], high[worst]]).all():
            return None
        spread = 0.5 * (high[worst] - low[worst]) / NORMAL_95
        value = math.exp(mean[worst])
        made[name] = {
            "expected": value,
            "upper": value * math.exp(factor * spread),
            "standard_error": value * spread,
        }
    return made


def student_bound(groups: int) -> float:
    """Factor on the bootstrap's standard deviation for a one-sided bound at `LEVEL`, for so many groups."""
    from scipy.special import stdtrit

    return float(stdtrit(groups - 1, LEVEL)) * math.sqrt(groups / (groups - 1))


def _worst(values: list[dict[str, float | None]]) -> dict[str, float | None]:
    """Largest estimate with its standard error, and the largest of all bounds."""
    worst = max(values, key=lambda value: value["expected"] or 0.0)
    return {**worst, "upper": max(value["upper"] or 0.0 for value in values)}


def _margin(away: NDArray[np.float64], distance: NDArray[np.float64], found: EnsembleHazard) -> float | None:
    """Smallest distance (m) of a site's edge beyond the line of the expected density's bound as it is drawn."""
    from flight.hazard.contours import smooth_outline

    expected = found.expected
    if found.undetermined:
        return None
    reach = expected.upper_by_direction if np.isfinite(expected.upper_by_direction).all() else expected.by_direction
    azimuth, line = smooth_outline(reach, expected.kernel)
    turn = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    return float((distance - np.interp(turn, azimuth, line, period=360.0)).min())
