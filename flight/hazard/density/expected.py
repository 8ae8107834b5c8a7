"""The hazard distance: the distance beyond which the expected density of hazardous fragments stays acceptable.

The acceptable density is about the expected number per area, so the density is the mean over realisations, never the
largest of many small counts. Two densities are estimated, on the ground and normal to the paths; the distance is the
larger of the two: a person is not to be exposed by either.

Density. Over distance it is estimated by local likelihood with a log-linear model and a Gaussian kernel of `RADIAL` in
ln r: with M the number of fragments per ln r, smoothed by the kernel to S, the estimate is S exp(-(h S'/S)^2 / 2)
(Hjort and Jones 1996), which has no bias where the density is a power of the distance. Over azimuth, where directions
differ, it is smoothed by a raised cosine whose half-width is an input. The distance of the smoothed field's worst
direction is what is estimated; symmetric directions are counted together.

Worst direction. The largest of estimates is too large on average. So the direction is also chosen on nine tenths of the
realisations and the density taken from the other tenth, ten times over (cross-fitting): that distance is too small on
average, as the direction chosen need not be the worst. The distance reported is the mean of both, and half of their
difference bounds its bias (`max_bias`).

Certainty. Standard error and one-sided 95 % bound come from the bootstrap over realisations (Efron 1979), or over
groups of neighbouring ones, with Student's factor for their number, in ln r.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError
from flight.hazard.density.density_counts import DensityGroups
from flight.hazard.density.directions import RADIAL, SPACING
from flight.hazard.density.distance import ExpectedDistance

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


KINDS = ("ground", "normal")
INSIDE, BEYOND = 0.6, 1.0  # of ln r about a distance, in which its bootstrap looks for it
NEAR_WORST = 0.3  # ln r below the worst direction's distance, within which others compete with it
FOLDS = 10


class Estimate:
    """One estimate: fields, positions and draws, and the distances from them.

    Fields are smoothed over distance first, group by group: all that follows is linear in them up to the density.
    """

    def __init__(self, groups: DensityGroups, limit: float, draws: int, seed: int) -> None:
        self.directions, self.limit = groups.directions, limit
        self.sums, self.sizes = groups.sums, groups.sizes  # (g, 2, c, r)
        grid = self.directions.grid
        if self.sums.shape[-1] > grid.shape[1]:  # fragments landed beyond the cells that were asked for
            grid = grid.up_to(grid.reach + grid.cell * (self.sums.shape[-1] - grid.shape[1]))
            self.directions = replace(self.directions, grid=grid)
        self.total, self.count = self.sums.sum(axis=0), int(self.sizes.sum())
        self.weights = self.directions.weights
        radial = self.directions.radial
        occupied = np.flatnonzero(self.total.any(axis=(0, 1)))
        end = math.log(self.directions.grid.edges[occupied[-1] + 1]) if occupied.size else radial.places[0]
        self.last = min(len(radial.places), int(np.searchsorted(radial.places, end + 4.0 * RADIAL)) + 2)
        self.radial = radial
        self.several = len(self.sums) > 1
        picks = np.random.default_rng(seed).multinomial(
            len(self.sizes), np.full(len(self.sizes), 1.0 / len(self.sizes)), size=draws
        )
        self.draws = picks / (picks @ self.sizes)[:, None] if self.several else np.zeros((0, 1))

    @property
    def everywhere(self) -> slice:
        """All positions up to the farthest fragment."""
        return slice(0, self.last)

    def _smoothed(self, number: Array, where: slice) -> tuple[Array, Array]:
        """Number per ln r (..., j) and its derivative from numbers per distance cell (..., r)."""
        smooth, slope = self.radial.smooth[: number.shape[-1], where], self.radial.slope[: number.shape[-1], where]
        return number @ smooth, number @ slope

    def _density(self, smoothed: tuple[Array, Array], where: slice) -> Array:
        """Densities (..., j) in 1/m2 from means per realisation and azimuth cell of what `_smoothed` gives."""
        found, change = smoothed
        with np.errstate(divide="ignore", invalid="ignore"):
            tilt = np.where(found > 0.0, change / found, 0.0)
        return np.asarray(found * np.exp(-0.5 * (RADIAL * tilt) ** 2) / self.radial.area[where])

    def _through(self, density: Array, where: slice) -> Array:
        """`ln r` (...) at which densities (..., j) fall through the limit for the last time; -inf where never above."""
        positions = self.radial.places[where]
        above = density >= self.limit
        reached = above.any(axis=-1)
        last = np.minimum(len(positions) - 1 - np.argmax(above[..., ::-1], axis=-1), len(positions) - 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            here, there = (
                np.log(np.take_along_axis(density, at[..., None], axis=-1)[..., 0] / self.limit)
                for at in (last, last + 1)
            )
            share = np.clip(here / (here - there), 0.0, 1.0)
        return np.asarray(np.where(reached, positions[last] + np.nan_to_num(share) * SPACING, -np.inf))

    def _around(self, *centres: float) -> slice:
        """Places about distances (ln r)."""
        known = [one for one in centres if math.isfinite(one)]
        if not known:
            return self.everywhere
        begin, end = np.searchsorted(self.radial.places, [min(known) - INSIDE, max(known) + BEYOND])
        return slice(min(int(begin), self.last - 2), min(int(end), self.last))

    def alone(self, sums: Array, near: float) -> float:
        """The distance (m) of one realisation, whose sums (2, c, r) are of the groups or reach less far.

        Looked for from somewhat below `near` (m) first, to save time.
        """
        number, found = self.weights @ sums, -np.inf
        begin = int(np.searchsorted(self.radial.places, math.log(max(near, 1e-3)) - INSIDE))
        for where in (slice(min(begin, self.last - 2), self.last), self.everywhere):
            found = self._through(self._density(self._smoothed(number, where), where), where).max()
            if np.isfinite(found):
                break
        return float(np.exp(found))

    def result(self, *, every_direction: bool) -> ExpectedDistance:
        """Distances, bound and curves."""
        number = np.einsum("dc,kcr->kdr", self.weights, self.total) / self.count  # (2, d, r)
        here = self.everywhere
        densities = self._density(self._smoothed(number, here), here)  # (2, d, j)
        found = self._through(densities, here)  # (2, d)
        larger = found.max(axis=0)
        worst = int(np.argmax(larger))
        plain = float(larger[worst])
        crossed = self._cross_fitted(larger) if len(larger) > 1 and self.several else plain
        middle, correction = 0.5 * (math.exp(plain) + math.exp(crossed)), 0.5 * abs(math.exp(plain) - math.exp(crossed))
        error, upper = None, None
        each = np.full(len(larger), np.nan)
        if self.several:
            groups = len(self.sizes)
            factor = math.sqrt(groups / (groups - 1))
            near = larger >= plain - NEAR_WORST
            drawn = {d: self.draws_of(found, d) for d in np.flatnonzero(near | every_direction).tolist()}
            spread = _spread(np.max([drawn[d] for d in np.flatnonzero(near).tolist()], axis=0)) * factor
            # The correction for choosing the direction scatters by its own size; it leans to no side of the bound.
            error, bound = math.hypot(middle * spread, correction), _student(groups - 1)
            upper = middle * math.exp(bound * spread)
            for d, draws in drawn.items():
                each[d] = math.exp(larger[d] + bound * _spread(draws) * factor)
            if not middle > 0.0:
                error, upper = self._where_none(drawn)
            each[each > upper], each[worst] = upper, upper  # the headline bounds every direction
        mean = self._density(self._smoothed(number[:, worst], here), here)
        low, high = self._band(worst) if every_direction and self.several else (mean[:, :0], mean[:, :0])
        axisymmetric = self.directions.axisymmetric
        reach = np.minimum(np.exp(larger), middle)
        of_every = np.zeros(1, dtype=np.int64) if axisymmetric else self.directions.of_every
        shown = of_every[:0] if axisymmetric or not every_direction else of_every
        return ExpectedDistance(
            middle, upper, error, float(np.exp(found[0].max())), float(np.exp(found[1].max())), self.directions.basis,
            None if axisymmetric else float(self.directions.azimuth[worst]), self.count, len(self.sizes),
            None if axisymmetric else self.directions.kernel, self.directions.mirrors,
            correction,
            self.directions.grid.width * np.arange(len(of_every)), reach[of_every], each[of_every],
            np.exp(self.radial.places[here]), mean, low, high,
            density_by_direction=densities[:, shown].astype(np.float32),
        )  # fmt: skip

    def _where_none(self, drawn: dict[int, Array]) -> tuple[float, float]:
        """Standard error and bound where the mean density nowhere reaches the limit, but that of some draws may."""
        highest = np.max(list(drawn.values()), axis=0)
        reach = np.where(highest > self.radial.places[0], np.exp(highest), 0.0)
        return float(reach.std(ddof=1)), float(np.quantile(reach, 0.95))

    def _drawn_densities(self, direction: int, kind: int, where: slice) -> Array:
        """Mean densities (b, j) of the bootstrap's draws in a direction."""
        fields = np.einsum("c,gcr->gr", self.weights[direction], self.sums[:, kind])
        smooth, slope = self._smoothed(fields, where)
        return self._density((self.draws @ smooth, self.draws @ slope), where)

    def draws_of(self, found: Array, direction: int) -> Array:
        """Draws (b,) of ln of the larger distance in one direction; short of the window they end at its beginning."""
        where = self._around(*found[:, direction][found[:, direction] >= found[:, direction].max() - NEAR_WORST])
        drawn = np.full(len(self.draws), self.radial.places[where.start])
        for kind in range(len(KINDS)):
            if found[kind, direction] >= found[:, direction].max() - NEAR_WORST:
                drawn = np.maximum(drawn, self._through(self._drawn_densities(direction, kind, where), where))
        return drawn

    def _band(self, direction: int) -> tuple[Array, Array]:
        """5 and 95 % of the mean density's draws in one direction (2, j)."""
        here = self.everywhere
        bands = [np.quantile(self._drawn_densities(direction, k, here), [0.05, 0.95], axis=0) for k in range(2)]
        return np.stack([low for low, _ in bands]), np.stack([high for _, high in bands])

    def _cross_fitted(self, larger: Array) -> float:
        """`ln r` of the density in directions that were chosen on other realisations."""
        folds = min(FOLDS, len(self.sizes))
        fold = np.arange(len(self.sizes)) % folds
        where = self._around(float(larger.max()))
        parts = np.stack([self.sums[fold == k].sum(axis=0) for k in range(folds)])  # (f, 2, c, r)
        counts = np.array([self.sizes[fold == k].sum() for k in range(folds)])
        smooth, slope = self._smoothed(np.einsum("dc,fkcr->fkdr", self.weights, parts), where)
        chosen = []
        for k in range(folds):
            others = tuple((part.sum(axis=0) - part[k]) / (self.count - counts[k]) for part in (smooth, slope))
            reach = self._through(self._density((others[0], others[1]), where), where).max(axis=0)
            chosen.append(int(np.argmax(reach)))
        held_out = tuple(
            sum(part[k][:, direction] for k, direction in enumerate(chosen)) / self.count for part in (smooth, slope)
        )
        return float(self._through(self._density((held_out[0], held_out[1]), where), where).max())


def _spread(draws: Array) -> float:
    """Standard deviation of draws in ln r."""
    return float(draws.std(ddof=1))


def _student(freedom: int) -> float:
    """95 % quantile of Student's distribution: Cornish-Fisher about the normal quantile (4 digits from 5 on)."""
    z, v = 1.6448536269514722, float(max(freedom, 1))
    return (
        z
        + (z**3 + z) / (4.0 * v)
        + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * v**2)
        + (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / (384.0 * v**3)
    )


DRAWS = 1000


def expected_distance(
    groups: DensityGroups, limit: float, *, draws: int = DRAWS, seed: int = 0, every_direction: bool = True
) -> ExpectedDistance:
    """Estimate the distance at which the expected density falls below `limit` (1/m2) for the last time.

    `draws` and `seed` are those of the bootstrap; `every_direction`: bounds of every direction and of the density too,
    not of the distance alone. Raises InputError where there is no realisation.
    """
    require_number("hazard", "limit", limit, "1/m2")
    if not groups.realisations:
        raise InputError("hazard: no realisation to assess")
    return Estimate(groups, limit, draws, seed).result(every_direction=every_direction)
