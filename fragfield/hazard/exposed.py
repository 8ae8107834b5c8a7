"""Exposed sites over all realisations: densities, hits and probabilities with bounds, and the verdict on each.

Bounds are one-sided at 95 % and hold for the expected value, for what the randomness of the break-up leaves open, not
for the uncertainty of inputs and models. A sum of weights of rare hits is bounded by the gamma law of Fay and Feuer
(Statistics in Medicine 16, 1997), which for equal weights is the exact Poisson bound; its variance is the larger of the
hits' own and that between realisations, and its largest weight the larger of a single hit's and of the total of one
realisation, since hits of one event may come together. Where nothing was hit at all it is the bound of single hits. A
share of realisations is bounded by Clopper and Pearson (1934).

A site in the open is judged by the worst of the places that it touches (`fragfield.hazard.places`). Where all azimuths
are alike (one upright round of revolution over even ground), it takes its densities from the curves over all azimuths
that the hazard distance rests on: the same expected value, known far better than by what passed at one azimuth. Beside
rounds whose nose may point anywhere the densities at a site for every direction of the nose are those of one flight at
all azimuths, smoothed by the kernel of the hazard distance.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight import FlightResult, Fragments
from flight.fluence import FluenceGrid, PolarGrid
from flight.hazard.density.expected import KINDS, ExpectedDistance
from flight.hazard.ensemble import EnsembleHazard
from flight.hazard.exposed import Prism, count_exposed, surfaces_of
from flight.scene.targets import Witness
from fragfield.case import CaseTable
from fragfield.case.conversion.exposed_sites import ExposedSite, exposed_sites_of, outline_of
from fragfield.case.conversion.surroundings import bearing_of
from fragfield.hazard.contours import smooth_outline
from fragfield.hazard.places import LEVEL, PlaceSums, kernel_weights, sum_bound
from fragfield.hazard.verdict import criterion_of, no_margin, part_of_criterion, verdict_of
from fragfield.results.site import Criterion, Estimate, NotStopped, Probability, SiteWithoutRicochet
from fragfield.results.site import ExposedSite as AssessedSite

Fields = tuple[NDArray[np.float64], NDArray[np.float64]]


def share_bound(count: int, number: int, level: float = LEVEL) -> float:
    """One-sided upper bound of a probability that came true `count` times in `number` (Clopper and Pearson 1934)."""
    from scipy.special import betaincinv

    return 1.0 if count >= number else float(betaincinv(count + 1.0, number - count, level))


@dataclass(frozen=True, eq=False)
class ExposedPlaces:
    """What the flights of a case count for its exposed sites, beyond the fields of its hazard distance."""

    sites: list[ExposedSite]
    """In the order of the case."""
    usual: FluenceGrid
    """What counts for the hazard distance."""

    @classmethod
    def of(cls, case: CaseTable, usual: FluenceGrid) -> ExposedPlaces:
        """Those of a resolved case."""
        return cls(exposed_sites_of(case), usual)

    @cached_property
    def prisms(self) -> list[Prism]:
        """Of the buildings."""
        return [site.prism for site in self.sites if site.prism is not None]

    @cached_property
    def further(self) -> list[FluenceGrid]:
        """What counts at sites in the open with an energy or a height of their own."""
        usual = self.usual.energy, self.usual.height
        own = {(site.energy, site.height) for site in self.sites if site.prism is None} - {usual}
        return [replace(self.usual, energy=energy, height=height) for energy, height in sorted(own)]

    @property
    def surfaces(self) -> list[Witness]:
        """Witness surfaces of the buildings."""
        return surfaces_of(self.prisms)

    def count(self, result: FlightResult, fragments: Fragments, first: int, *, ricochet: bool = True) -> NDArray[Any]:
        """Counts of one flight (buildings,), whose witnesses from `first` on are `surfaces`."""
        with np.errstate(over="ignore"):
            speed = fragments.speed
        return count_exposed(result, self.prisms, first, fragments.position, speed, ricochet=ricochet)


@dataclass(frozen=True, eq=False)
class ExposedCounts:
    """What one flight gives the exposed sites, with or without ricochet."""

    fields: dict[tuple[float, float], Fields]
    """Landings, and lengths of paths over the height, by energy (J) and height (m)."""
    buildings: NDArray[Any]
    """Counts (buildings,) of flight.hazard.exposed.COUNTS."""


class ExposedSums:
    """Sums of the counts over realisations.

    `case`: resolved; of an attitude in which it is turned, as turned; `grid` of the fields; `kernel`: half-width of the
    azimuth kernel (degrees); `turned`: the nose may point anywhere; `alike`: all azimuths are, so that the mean over
    them is taken.
    """

    def __init__(
        self, case: CaseTable, sites: list[ExposedSite], grid: PolarGrid, kernel: float, *, turned: bool = False,
        alike: bool = False,
    ) -> None:  # fmt: skip
        self.case, self.sites, self.realisations = case, sites, 0
        cells = grid.azimuth_cells
        self._spread = np.full((cells, cells), 1.0 / cells) if alike else None
        if turned and not alike:
            self._spread = kernel_weights(grid, kernel)
        self._new = lambda: ExposedSums(case, sites, grid, kernel, turned=turned, alike=alike)
        self._grid, self._turned = grid, turned
        self._places: dict[tuple[float, float], PlaceSums] = {}
        self._buildings: list[NDArray[Any]] = []  # of every realisation
        self._short: ExposedSums | None = None

    def add(self, counts: ExposedCounts, short: ExposedCounts | None = None) -> None:
        """Add one realisation, and what it gives without ricochet."""
        if short is not None:
            self._short = self._short or self._new()
            self._short.add(short)
        for key, field in counts.fields.items():
            if key not in self._places:
                self._places[key] = PlaceSums(self._grid, key[1], self._spread)
            self._places[key].add(*field)
        self._buildings.append(counts.buildings)
        self.realisations += 1

    def _mean(self, name: str, index: int, single: float) -> Estimate:
        n = self.realisations
        counted = np.stack(self._buildings)[:, index]
        values = counted[name].astype(np.float64)
        total, between = float(values.sum()), float((values**2).sum())
        own = f"{name}_squares"
        squares = float(counted[own].sum()) if own in (counted.dtype.names or ()) else total
        spread = n / (n - 1) * max(between - total**2 / n, 0.0) if n > 1 else 0.0
        largest = max(single, float(values.max()))
        upper = float(sum_bound(np.array(total), np.array(max(squares, spread)), np.array(largest)))
        error = math.sqrt(spread) / n if n > 1 else None
        return Estimate(expected=total / n, upper=upper / n, standard_error=error)

    def assess(self, found: EnsembleHazard, *, determined: bool = True) -> tuple[AssessedSite, ...]:
        """One a site (SI, degrees); `determined`: whether all flights ended."""
        return tuple(self._entry(site, found, determined=determined) for site in self.sites)

    def _entry(self, site: ExposedSite, found: EnsembleHazard, *, determined: bool) -> AssessedSite:
        case = self.case
        distance, azimuth = site.nearest(case.flight.origin)
        values, largest = self._values(site, None if found.undetermined else found.expected)
        if self._short is not None:
            expected = None if found.undetermined else found.without_ricochet or found.expected
            short, _ = self._short._values(site, expected)
            values["without_ricochet"] = SiteWithoutRicochet.of_stage(short)
        quantity, limit = criterion_of(case, site)
        entry: dict[str, Any] = {
            "name": site.table.name,
            "kind": site.table.kind,
            "place": tuple(site.centre),
            "outline": tuple(map(tuple, site.outline.tolist())),
            "distance": distance,
            "azimuth_deg": azimuth,
            "bearing_deg": bearing_of(case, azimuth),
            "energy": site.energy,
            **(values if determined else dict.fromkeys(values)),
            "largest_energy": largest,
            "criterion": Criterion(quantity=quantity, limit=limit),
            "realisations": self.realisations,
            "level": LEVEL,
        }
        without = no_margin(case, site) or None
        margin = None if without else _margin(site.edge() - np.asarray(case.flight.origin), found)
        made = AssessedSite(**entry, verdict="not determined", no_margin=without, margin=margin)
        return replace(made, verdict=verdict_of(made)) if determined else made

    def _values(self, site: ExposedSite, expected: ExpectedDistance | None) -> tuple[dict[str, Any], float | None]:
        """What a site meets, which is not known where flights have not ended, and the largest energy of a hit."""
        if site.prism is not None:
            buildings = [one for one in self.sites if one.prism is not None]
            return self._building(buildings.index(site), site, site.prism)
        origin = np.asarray(self.case.flight.origin)
        plans = [outline_of(one) - origin for one in self.case.obstacle]
        places = self._places[site.energy, site.height]
        (ground, normal), worst, count = places.worst([piece - origin for piece in site.pieces], plans)
        around = None if self._turned else _all_round(self.case, site, expected)
        if around is not None:
            ground, normal = around
        target = site.area * getattr(site.table, "number", 1.0)
        hits = _times(normal, target)
        of_a_hit = {key: -math.expm1(-(getattr(hits, key) or 0.0)) for key in ("expected", "upper")}
        return {
            "density_normal": normal,
            "density_ground": ground,
            "expected_hits": hits,
            "probability": Probability(**of_a_hit),
            "places": count,
            "worst_place": tuple((worst + origin).tolist()),
            "target_area": target,
            "not_stopped": None,
            "barrier": None,
        }, None

    def _building(self, index: int, site: ExposedSite, prism: Prism) -> tuple[dict[str, Any], float | None]:
        n, counted = self.realisations, np.stack(self._buildings)[:, index]
        count, through = (int((counted[name] > 0).sum()) for name in ("hits", "through"))
        barriers = {name: getattr(prism, name).source for name in ("wall", "roof") if getattr(prism, name) is not None}
        passed = self._mean("through", index, 1.0)
        not_stopped = NotStopped(
            expected=passed.expected, upper=passed.upper, standard_error=passed.standard_error,
            probability=Probability(expected=through / n, upper=share_bound(through, n)),
        )  # fmt: skip
        return {
            "density_normal": self._mean("fluence", index, 1.0 / prism.min_shadow),
            "density_ground": None,
            "expected_hits": self._mean("hits", index, 1.0),
            "probability": Probability(expected=count / n, upper=share_bound(count, n)),
            "places": 1,
            "worst_place": tuple(site.centre),
            "target_area": None,
            "not_stopped": not_stopped if barriers else None,
            "barrier": barriers or None,
        }, float(counted["energy"].max())


def _times(one: Estimate, factor: float) -> Estimate:
    values = (one.expected, one.upper, one.standard_error)
    expected, upper, error = (None if value is None else value * factor for value in values)
    return Estimate(expected=expected, upper=upper, standard_error=error)


def worst_of_attitudes(
    entries: Sequence[tuple[tuple[float, float], Sequence[AssessedSite]]],
) -> tuple[AssessedSite, ...]:
    """For every site its entry in the attitude in which least is left to its criterion, with that attitude.

    `entries`: inclination and roll (degrees), and the sites, of every attitude that was flown.
    """
    worst = []
    for of_site in zip(*(rows for _, rows in entries), strict=True):
        parts = [np.inf if (part := part_of_criterion(one)) is None else part for one in of_site]
        at = int(np.argmax(parts))
        inclination, roll = entries[at][0]
        worst.append(replace(of_site[at], worst_inclination_deg=inclination, worst_roll_deg=roll))
    return tuple(worst)


def _all_round(
    case: CaseTable, site: ExposedSite, expected: ExpectedDistance | None
) -> tuple[Estimate, Estimate] | None:
    """Densities on the ground and normal to the paths over all azimuths, the largest over the distances of a site.

    None where they are not the site's.

    They are not where directions differ, where the site has an energy or a height of its own, or where too few
    fragments reach so far that a bound could be drawn from them.
    """
    from scipy.special import stdtrit

    usual = case.hazard.energy, case.hazard.person_height
    if expected is None or expected.direction is not None or not expected.density_high.size:
        return None
    if (site.energy, site.height) != usual:
        return None
    away = site.edge() - np.asarray(case.flight.origin)
    distance = np.hypot(away[:, 0], away[:, 1])
    ends = np.clip([distance.min(), distance.max()], 1e-3, None)
    inner = expected.radius[(expected.radius > ends[0]) & (expected.radius < ends[1])]
    at = np.log(np.concatenate([ends, inner]))  # between its points the curve is a line in logarithms
    # of the bootstrap's standard deviation, one-sided, for so many groups
    factor = float(stdtrit(expected.groups - 1, LEVEL)) * math.sqrt(expected.groups / (expected.groups - 1))
    made = {}
    for kind, name in enumerate(KINDS):
        with np.errstate(divide="ignore"):
            mean, low, high = (
                np.interp(at, np.log(expected.radius), np.log(rows[kind]), right=-np.inf)
                for rows in (expected.density, expected.density_low, expected.density_high)
            )
        worst = int(np.argmax(mean))
        if not np.isfinite([mean[worst], low[worst], high[worst]]).all():
            return None
        with np.errstate(invalid="ignore"):
            spread = 0.5 * (high - low) / factor
            upper = np.exp(high)
        value = math.exp(mean[worst])
        bound = float(upper[np.isfinite(upper)].max())
        made[name] = Estimate(expected=value, upper=bound, standard_error=value * float(spread[worst]))
    return made["ground"], made["normal"]


def _margin(away: NDArray[np.float64], found: EnsembleHazard) -> float | None:
    """Smallest distance (m) of a site's edge beyond the line of the expected density's bound as it is drawn."""
    expected = found.expected
    if found.undetermined:
        return None
    reach = expected.upper_by_direction if np.isfinite(expected.upper_by_direction).all() else expected.by_direction
    azimuth, line = smooth_outline(reach, expected.kernel)
    turn = np.degrees(np.arctan2(away[:, 1], away[:, 0]))
    return float((np.hypot(*away.T) - np.interp(turn, azimuth, line, period=360.0)).min())
