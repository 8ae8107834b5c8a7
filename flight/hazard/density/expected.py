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
taken off the distance. Deviations pass by the root, as those of the posterior do (Wahba 1983): they bear the flattening
of peaks too.

Certainty. Standard error and one-sided 95 % bound come from the bootstrap over realisations (Efron 1979), or over
groups of neighbouring ones, in ln r. By as much as a draw changes the density at the distance of a direction, the mean
density is raised or lowered everywhere: where that falls through the limit is the drawn distance. The standard error is
that of the largest of all directions. The bound is where the upper edge of the density's band in the worst direction
falls through the limit, with Student's factor: noise decorrelates over a kernel's width, and grows with the distance,
so that the scatter at the distance alone gives too short a bound. Where several directions compete the band is narrower
by what the largest of them scatters less.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError
from flight.hazard.density.density_counts import DensityGroups
from flight.hazard.density.directions import RADIAL, SPACING, held

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


KINDS = ("ground", "normal")
INSIDE = 0.6  # of ln r that a draw may lie short of a distance
_LOWEST = 1e-40  # density over the limit that is not none
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


@dataclass(frozen=True, eq=False, repr=False)
class ExpectedDistance:
    """The hazard distance of an ensemble; lengths in m.

    Attributes
    ----------
    distance, upper, standard_error : float or None
        Distance of the expected density, its one-sided 95 % upper bound, standard error; the last two None for a
        single realisation.
    ground, normal : float
        Distances of both densities alone (plain largest over directions).
    basis : str
        "all_azimuths" or "worst_direction".
    direction : float or None
        Worst direction (degrees), None over all azimuths.
    realisations, groups : int
        Realisations, and groups of them that the bootstrap draws.
    kernel : float or None
        Half-width of the azimuth kernel (degrees), None over all azimuths.
    mirrors : tuple of float
        Azimuths of mirror planes about which directions were folded (degrees).
    max_bias : float
        Bias of taking the worst direction, taken off `distance`.
    azimuth, by_direction, upper_by_direction : (k,) float64
        Directions all around (degrees), the distance in each, and its one-sided 95 % bound in that direction (NaN for
        a single realisation), neither beyond the distance and the bound above. Over all azimuths one entry.
    radius : (j,) float64
        Places of the curves.
    density, density_low, density_high : (2, j) float64
        Expected density on the ground and normal to the path (1/m2) over all azimuths or in the worst direction, and
        its one-sided bounds of 95 % at each place: the certainty of the mean, not the scatter of single events.
    without_ricochet : ExpectedDistance or None
        The same of what fragments do before their first impact on the ground; None where they stay there.
    density_by_direction : (2, k, j) float32
        The expected densities in every direction of `azimuth`; empty over all azimuths, or where not asked for.
    """

    distance: float
    upper: float | None
    standard_error: float | None
    ground: float
    normal: float
    basis: str
    direction: float | None
    realisations: int
    groups: int
    kernel: float | None
    mirrors: tuple[float, ...]
    max_bias: float
    azimuth: Array
    by_direction: Array
    upper_by_direction: Array
    radius: Array
    density: Array
    density_low: Array = field(default_factory=lambda: np.zeros((2, 0)))
    density_high: Array = field(default_factory=lambda: np.zeros((2, 0)))
    without_ricochet: ExpectedDistance | None = None
    density_by_direction: NDArray[np.float32] = field(default_factory=lambda: np.zeros((2, 0, 0), np.float32))

    def __repr__(self) -> str:
        bound = "no upper bound" if self.upper is None else f"upper bound (95 %) {self.upper:.4g} m"
        return f"<flight.ExpectedDistance: {self.distance:.4g} m, {bound}, {self.realisations} realisations>"

    @property
    def relative_error(self) -> float:
        """Standard error over the distance; infinite for a single realisation, 0 where there is no hazard."""
        if self.standard_error is None:
            return math.inf
        return self.standard_error / self.distance if self.distance > 0.0 else 0.0

    @property
    def uncertainty(self) -> float:
        """The larger of standard error and `max_bias` over the distance: what more realisations reduce."""
        return max(self.relative_error, self.max_bias / self.distance if self.distance > 0.0 else 0.0)


class Estimate:
    """One estimate: densities in all directions, how they scatter, and the distances from them.

    Fields are smoothed over distance first, group by group: all that follows is linear in them up to the density.
    """

    def __init__(self, groups: DensityGroups, limit: float) -> None:
        self.directions, self.limit = groups.directions, limit
        self.sums, self.sizes = groups.sums, groups.sizes  # (g, 2, c, r)
        grid = self.directions.grid
        if self.sums.shape[-1] > grid.shape[1]:  # fragments landed beyond the cells that were asked for
            grid = grid.up_to(grid.reach + grid.cell * (self.sums.shape[-1] - grid.shape[1]))
            self.directions = replace(self.directions, grid=grid)
        self.total, self.count = self.sums.sum(axis=0), int(self.sizes.sum())
        self.radial = self.directions.radial
        occupied = np.flatnonzero(self.total.any(axis=(0, 1)))
        end = math.log(self.directions.grid.edges[occupied[-1] + 1]) if occupied.size else self.radial.places[0]
        self.last = min(len(self.radial.places), int(np.searchsorted(self.radial.places, end + 4.0 * RADIAL)) + 2)
        self.places, self.area = self.radial.places[: self.last], self.radial.area[: self.last]
        self.several = len(self.sums) > 1
        self.draws = np.zeros((0, 1))  # of the mean's weights of the groups, less those that they have
        if self.several:
            number = len(self.sizes)
            picks = np.random.default_rng(0).multinomial(number, np.full(number, 1.0 / number), size=DRAWS)
            self.draws = picks / (picks @ self.sizes)[:, None] - 1.0 / self.count
        # Of means, and of deviations from them, by class (2, d, c).
        self.weights = np.stack([self.directions.weights()] * len(KINDS))
        self.deviations = self.weights.copy()
        if self.several and not self.directions.axisymmetric:
            self._smooth_over_azimuth()

    def _density(self, number: Array) -> Array:
        """Densities (..., j) in 1/m2 from means (..., r) per realisation and azimuth cell."""
        found, change = self.radial.smoothed(number, self.last)
        with np.errstate(divide="ignore", invalid="ignore"):
            tilt = np.where(found > 0.0, change / found, 0.0)
        return np.asarray(found * np.exp(-0.5 * (RADIAL * tilt) ** 2) / self.area)

    def _through(self, density: Array) -> Array:
        """`ln r` (...) at which densities (..., j) fall through the limit for the last time; -inf where never above."""
        above = density >= self.limit
        reached = above.any(axis=-1)
        last = np.minimum(len(self.places) - 1 - np.argmax(above[..., ::-1], axis=-1), len(self.places) - 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            here, there = (
                np.log(np.take_along_axis(density, at[..., None], axis=-1)[..., 0] / self.limit)
                for at in (last, last + 1)
            )
            share = np.clip(here / (here - there), 0.0, 1.0)
        return np.asarray(np.where(reached, self.places[last] + np.nan_to_num(share) * SPACING, -np.inf))

    def alone(self, sums: Array) -> float:
        """The distance (m) of one realisation, whose sums (2, c, r) are of the groups or reach less far."""
        return float(np.exp(self._through(self._density(self.directions.weights() @ sums)).max()))

    def result(self) -> ExpectedDistance:
        """Distances, bound and curves."""
        number, densities, found = self._mean()
        larger = found.max(axis=0)
        worst = int(np.argmax(larger))
        plain = float(larger[worst])
        middle, bias = math.exp(plain), 0.0
        error, upper = None, None
        each = np.full(len(larger), np.nan)
        low = high = densities[:, worst, :0]
        if self.several:
            groups = len(self.sizes)
            factor = math.sqrt(groups / (groups - 1))
            relative = self._relative(number, densities, found)  # (2, d, b)
            drawn = self._drawn(densities, found, relative)
            near = larger >= plain - NEAR_WORST
            largest, scatter = drawn[near].max(axis=0), drawn.std(axis=1, ddof=1)
            width = _student(groups - 1) * factor * self._scatter(number[:, worst], worst)
            low, high = densities[:, worst] * np.exp(-width), densities[:, worst] * np.exp(width)
            each = np.exp(larger + _student(groups - 1) * factor * scatter)
            if middle > 0.0:
                spread = float(largest.std(ddof=1))
                if len(larger) > 1:
                    bias = middle * max(0.0, math.expm1(float(largest.mean()) - plain))
                narrower = min(1.0, spread / scatter[worst]) if scatter[worst] > 0.0 else 1.0
                beyond = float(self._through(densities[:, worst] * np.exp(narrower * width)).max()) - plain
                error, middle = middle * spread * factor, middle - bias
                upper = middle * math.exp(beyond)
            else:
                reach = np.where(largest > self.places[0], np.exp(largest), 0.0)
                error, upper = float(reach.std(ddof=1)), float(np.quantile(reach, 0.95))
            each = np.minimum(each, upper)
            each[worst] = upper
        axisymmetric = self.directions.axisymmetric
        of_every = np.zeros(1, dtype=np.int64) if axisymmetric else self.directions.of_every
        return ExpectedDistance(
            middle, upper, error, float(np.exp(found[0].max())), float(np.exp(found[1].max())), self.directions.basis,
            None if axisymmetric else float(self.directions.azimuth[worst]), self.count, len(self.sizes),
            None if axisymmetric else self.directions.kernel, self.directions.mirrors,
            bias,
            self.directions.grid.width * np.arange(len(of_every)), np.minimum(np.exp(larger), middle)[of_every],
            each[of_every], np.exp(self.places), densities[:, worst], low, high,
            density_by_direction=densities[:, of_every[:0] if axisymmetric else of_every].astype(np.float32),
        )  # fmt: skip

    def _mean(self) -> tuple[Array, Array, Array]:
        """Numbers (2, d, r) per azimuth cell in every direction, densities (2, d, j), and ln of distances (2, d)."""
        number = self.weights @ self.total / self.count
        densities = self._density(number)
        return number, densities, self._through(densities)

    def _smooth_over_azimuth(self) -> None:
        """Settle the smoothing of each kind about the distance that it gives."""
        for _ in range(_ROUNDS):
            found = self._mean()[2]
            for kind in range(len(KINDS)):
                if math.isfinite(worst := float(found[kind].max())):
                    begin, end = np.searchsorted(self.places, [worst - _ABOUT, worst + _ABOUT])
                    where = slice(min(int(begin), len(self.places) - 1), max(int(end), int(begin) + 1))
                    smooth = self.radial.smooth[: self.sums.shape[-1], where]
                    cells = held(smooth.any(axis=1))
                    near = np.tensordot(self.sums[:, kind, :, cells], smooth[cells], 1).swapaxes(1, 2)
                    kept = passed(np.fft.rfft(self.directions.unfolded(near)), self.sizes)
                    self.weights[kind] = self.directions.weights(kept)
                    self.deviations[kind] = self.directions.weights(np.sqrt(kept))

    def _relative(self, number: Array, densities: Array, found: Array) -> Array:
        """Deviations (2, d, b) of the bootstrap's mean densities, over the mean, at the distances or where highest."""
        at = np.searchsorted(self.places, found)
        at = np.where(np.isfinite(found), np.minimum(at, len(self.places) - 1), densities.argmax(axis=-1))
        cells = held(self.radial.smooth[: number.shape[-1], at.min() : at.max() + 1].any(axis=1))
        smooth, slope = (one[cells].T[at] for one in (self.radial.smooth, self.radial.slope))  # (2, d, r)
        with np.errstate(divide="ignore", invalid="ignore"):
            mean, change = ((number[..., cells] * one).sum(axis=-1)[..., None] for one in (smooth, slope))
            tilt = RADIAL * change / mean
            kernel = np.nan_to_num(((1.0 + tilt**2) * smooth - RADIAL * tilt * slope) / mean)
        sums = [np.tensordot(self.sums[:, kind, :, cells], kernel[kind], (2, 1)) for kind in range(len(KINDS))]
        groups = np.stack([np.einsum("gcd,dc->gd", *both) for both in zip(sums, self.deviations, strict=True)], axis=1)
        return np.moveaxis(np.tensordot(self.draws, groups, 1), 0, -1)

    def _scatter(self, number: Array, direction: int) -> Array:
        """Standard deviations (2, j) of ln density in a direction, whose mean numbers are (2, r)."""
        fields = np.einsum("kc,gkcr->gkr", self.deviations[:, direction], self.sums)
        (mean, change), (smooth, slope) = (self.radial.smoothed(one, self.last) for one in (number, fields))
        with np.errstate(divide="ignore", invalid="ignore"):
            tilt = RADIAL * change / mean
            groups = np.nan_to_num(((1.0 + tilt**2) * smooth - RADIAL * tilt * slope) / mean)
        away = groups - self.sizes[:, None, None] * (groups.sum(axis=0) / self.count)
        scatter = np.sqrt((away**2).sum(axis=0)) / self.count  # as that of draws
        return np.asarray(np.minimum(scatter, 1.0))

    def _drawn(self, densities: Array, found: Array, relative: Array) -> Array:
        """Draws (d, b) of ln of the larger distance in every direction."""
        drawn = np.full(relative.shape[1:], -np.inf)
        with np.errstate(divide="ignore"):
            highest = np.log(np.maximum(np.maximum.accumulate(densities[..., ::-1], axis=-1) / self.limit, _LOWEST))
            levels = -np.log(np.maximum(1.0 + relative, 0.0))
        for kind, d in np.ndindex(found.shape):
            if found[kind, d] >= found[:, d].max() - NEAR_WORST:
                shortest = max(self.places[0], found[kind, d] - INSIDE)
                through = np.interp(levels[kind, d], highest[kind, d], self.places[::-1], right=shortest)
                drawn[d] = np.maximum(drawn[d], np.maximum(through, shortest))
        return drawn


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


def _student(freedom: int) -> float:
    """95 % quantile of Student's distribution: Cornish-Fisher about the normal quantile (4 digits from 5 on)."""
    z, v = NORMAL_95, float(max(freedom, 1))
    return (
        z
        + (z**3 + z) / (4.0 * v)
        + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * v**2)
        + (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / (384.0 * v**3)
    )


DRAWS = 1000
NORMAL_95 = 1.6448536269514722


def expected_distance(groups: DensityGroups, limit: float) -> ExpectedDistance:
    """Estimate the distance at which the expected density falls below `limit` (1/m2) for the last time.

    Raises InputError where there is no realisation.
    """
    require_number("hazard", "limit", limit, "1/m2")
    if not groups.realisations:
        raise InputError("hazard: no realisation to assess")
    return Estimate(groups, limit).result()
