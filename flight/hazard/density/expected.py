"""The hazard distance: the distance beyond which the expected density of hazardous fragments stays acceptable.

The acceptable density is about the expected number per area, so the density is the mean over realisations, never the
largest of many small counts. Two densities are estimated, on the ground and normal to the paths; the distance is the
larger of the two: a person is not to be exposed by either.

Density. Over distance it is estimated by local likelihood with a log-linear model and a Gaussian kernel of `RADIAL` in
ln r: with M the number of fragments per ln r, smoothed by the kernel to S, the estimate is S exp(-(h S'/S)^2 / 2)
(Hjort and Jones 1996), which has no bias where the density is a power of the distance. Over azimuth, where directions
differ, it is smoothed by a raised cosine whose half-width is an input. The distance of the smoothed field's worst
direction is what is estimated; symmetric directions are counted together.

Worst direction. The largest of noisy estimates is too large on average. So the density is smoothed over azimuth once
more, as much as its noise asks: its Fourier component k passes by S/(S + N), with the noise N measured between
realisations, which is the same for all k, and the prior variance S of greatest likelihood (empirical Bayes: a penalised
Fourier series whose penalty the data choose). Directions that are alike pool themselves, and what stands out of the
noise stays. What the mean of the largest of draws exceeds the largest by is the bias that is left (`max_bias`): it is
taken off the distance, and the upper bound is above both. Deviations pass by the root, as those of the posterior do
(Wahba 1983): they bear the flattening of peaks too.

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
DECAYS = (0.0, 1.0, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0)
WIDTHS = (2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0, 32.0)
"""Prior variances of the Fourier components of the azimuth: A k^-p with exponents p, A exp(-(k/b)^2) with widths b."""
AMPLITUDES = np.concatenate([[0.0], np.exp(np.linspace(-5.0, 15.0, 61))])
"""A over the noise of a component."""
_PEAKED = 20.0  # gain in ln likelihood from which directions differ beyond doubt
_FLATTENING = 0.25  # of the noise, there: with all of it narrow peaks lose 0.2 % of their distance
_ABOUT = 0.1  # of ln r about a distance, over which the smoothing in azimuth is settled
_ROUNDS = 3


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
        # Of means, and of deviations from them, by class (2, d, c).
        self.weights = np.stack([self.directions.weights()] * len(KINDS))
        self.deviations = self.weights.copy()
        if self.several and not self.directions.axisymmetric:
            self._smooth_over_azimuth()

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
        number, found = self.directions.weights() @ sums, -np.inf
        begin = int(np.searchsorted(self.radial.places, math.log(max(near, 1e-3)) - INSIDE))
        for where in (slice(min(begin, self.last - 2), self.last), self.everywhere):
            found = self._through(self._density(self._smoothed(number, where), where), where).max()
            if np.isfinite(found):
                break
        return float(np.exp(found))

    def result(self, *, every_direction: bool) -> ExpectedDistance:
        """Distances, bound and curves."""
        here = self.everywhere
        number, densities, found = self._mean()
        larger = found.max(axis=0)
        worst = int(np.argmax(larger))
        plain = float(larger[worst])
        middle, bias = math.exp(plain), 0.0
        error, upper = None, None
        each = np.full(len(larger), np.nan)
        if self.several:
            groups = len(self.sizes)
            factor = math.sqrt(groups / (groups - 1))
            near = larger >= plain - NEAR_WORST
            drawn = {d: self.draws_of(found, d) for d in np.flatnonzero(near | every_direction).tolist()}
            largest = np.max([drawn[d] for d in np.flatnonzero(near).tolist()], axis=0)
            spread, bound = _spread(largest) * factor, _student(groups - 1)
            if middle > 0.0 and len(larger) > 1:
                bias = middle * max(0.0, math.expm1(float(largest.mean()) - plain))
            error, upper, middle = middle * spread, middle * math.exp(bound * spread), middle - bias
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
            bias,
            self.directions.grid.width * np.arange(len(of_every)), reach[of_every], each[of_every],
            np.exp(self.radial.places[here]), mean, low, high,
            density_by_direction=densities[:, shown].astype(np.float32),
        )  # fmt: skip

    def _mean(self) -> tuple[Array, Array, Array]:
        """Numbers (2, d, r) per azimuth cell in every direction, densities (2, d, j), and ln of distances (2, d)."""
        here = self.everywhere
        number = np.einsum("kdc,kcr->kdr", self.weights, self.total) / self.count
        densities = self._density(self._smoothed(number, here), here)
        return number, densities, self._through(densities, here)

    def _smooth_over_azimuth(self) -> None:
        """Settle the smoothing of each kind about the distance that it gives."""
        for _ in range(_ROUNDS):
            found = self._mean()[2]
            for kind in range(len(KINDS)):
                if math.isfinite(worst := float(found[kind].max())):
                    begin, end = np.searchsorted(self.radial.places, [worst - _ABOUT, worst + _ABOUT])
                    where = slice(min(int(begin), self.last - 1), max(min(int(end), self.last), int(begin) + 1))
                    smooth = self.radial.smooth[: self.sums.shape[-1], where]
                    cells = self.directions.unfolded((self.sums[:, kind] @ smooth).swapaxes(1, 2))
                    kept = passed(np.fft.rfft(cells), self.sizes)
                    self.weights[kind] = self.directions.weights(kept)
                    self.deviations[kind] = self.directions.weights(np.sqrt(kept))

    def _where_none(self, drawn: dict[int, Array]) -> tuple[float, float]:
        """Standard error and bound where the mean density nowhere reaches the limit, but that of some draws may."""
        highest = np.max(list(drawn.values()), axis=0)
        reach = np.where(highest > self.radial.places[0], np.exp(highest), 0.0)
        return float(reach.std(ddof=1)), float(np.quantile(reach, 0.95))

    def _drawn_densities(self, direction: int, kind: int, where: slice) -> Array:
        """Mean densities (b, j) of the bootstrap's draws in a direction."""
        mean = self._smoothed(self.weights[kind, direction] @ self.total[kind] / self.count, where)
        fields = np.einsum("c,gcr->gr", self.deviations[kind, direction], self.sums[:, kind])
        centre = self._smoothed(fields.sum(axis=0) / self.count, where)
        smooth, slope = (
            self.draws @ part + (of_mean - of_fields)
            for part, of_mean, of_fields in zip(self._smoothed(fields, where), mean, centre, strict=True)
        )
        return self._density((np.maximum(smooth, 0.0), slope), where)

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


def passed(components: NDArray[np.complex128], sizes: NDArray[np.int64]) -> Array:
    """Fraction (k,) of every Fourier component of the mean that stands out of the noise; 1 of the mean over azimuth.

    `components` (g, j, k): sums of groups of realisations at some distances, whose `sizes` are (g,).
    """
    groups = len(sizes)
    mean = components.sum(axis=0) / sizes.sum()
    deviations = np.abs(components - sizes[:, None, None] * mean) ** 2
    noise = deviations.sum(axis=0).mean(axis=0)[1:] / sizes.sum() ** 2 * groups / (groups - 1)
    kept = np.ones(components.shape[-1])
    free = np.flatnonzero(noise > 1e-9 * noise.max(initial=0.0))  # the others vanish by symmetry
    if not free.size:
        return kept
    level, power, order = noise[free].mean(), (np.abs(mean) ** 2).mean(axis=0)[1:][free], 1.0 + free
    shapes = np.concatenate([order ** -np.array(DECAYS)[:, None], np.exp(-((order / np.array(WIDTHS)[:, None]) ** 2))])
    prior = AMPLITUDES[:, None, None] * shapes  # (A, s, k) over the noise
    likelihood = -(np.log1p(prior) + power / level / (1.0 + prior)).sum(axis=-1)
    best = np.unravel_index(np.argmax(likelihood), likelihood.shape)
    doubt = max(0.0, 1.0 - float(likelihood[best] - likelihood[0, 0]) / _PEAKED)
    kept[1 + free] = prior[best] / (_FLATTENING + (1.0 - _FLATTENING) * doubt + prior[best])
    return kept


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
