"""The hazard distance: where the expected density of hazardous fragments falls below the acceptable one for good.

The acceptable density is about the expected number per area, so the density is the mean over realisations, never the
largest of many small counts. Two densities are estimated, on the ground and normal to the paths; the distance is the
larger of theirs: a person is not to be exposed by either.

Density. Over distance it is estimated by local likelihood with a log-linear model and a Gaussian kernel of `RADIAL` in
ln r: with M the number of fragments per ln r, smoothed by the kernel to S, the estimate is S exp(-(h S'/S)^2 / 2)
(Hjort and Jones 1996), which has no bias where the density is a power of the distance. Over azimuth, where directions
differ, it is smoothed by a raised cosine whose half-width is an input. The distance of the smoothed field's worst
direction is what is estimated; symmetric directions are counted together.

Worst direction. The largest of estimates is too large on average. So the direction is also chosen on nine tenths of the
realisations and the density taken from the other tenth, ten times over (cross-fitting): that distance is too small on
average, as the direction chosen need not be the worst. The distance reported is the middle of both, and half of their
difference bounds its bias (`max_bias`).

Certainty. Standard error and one-sided 95 % bound come from the bootstrap over realisations (Efron 1979), or over
groups of those drawn together, with Student's factor for their number, in ln r.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from flight.arguments import require_number
from flight.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.hazard.density.polar_grid import PolarGrid

    Array = NDArray[np.float64]

__all__ = ["KINDS", "DensityGroups", "Directions", "ExpectedDistance", "drawn_distances", "expected_distance"]

KINDS = ("ground", "normal")
RADIAL = 0.04  # h: standard deviation of the radial kernel in ln r
SPACING = 0.02  # in ln r, of the places at which the density is computed; between them it is a power of r
INSIDE, BEYOND = 0.6, 1.0  # of ln r about a distance, in which its bootstrap looks for it
NEAR_WORST = 0.3  # ln r below the worst direction's distance, within which others compete with it
DRAWS = 1000
FOLDS = 10
_COSINE_MOMENT = 1.0 / 3.0 - 2.0 / math.pi**2  # second moment of the raised cosine over its half-width squared
MEMORY = 96e6  # bytes of the groups' fields


@dataclass(frozen=True, eq=False)
class Directions:
    """Directions in which distances are estimated, and how the cells of azimuth weigh in each.

    Attributes
    ----------
    grid : PolarGrid
        Cells of azimuth and distance.
    basis : "all_azimuths" or "worst_direction"
        Whether all azimuths are one direction.
    kernel : float
        Half-width of the azimuth kernel (degrees).
    mirrors : tuple of float
        Azimuths of the mirror planes that were used (degrees).
    """

    grid: PolarGrid
    basis: str = "all_azimuths"
    kernel: float = 10.0
    mirrors: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        """Refuse a kernel that is not numeric."""
        require_number("hazard", "kernel", self.kernel, "degrees")

    @property
    def all_alike(self) -> bool:
        """Whether all azimuths are one direction."""
        return self.basis == "all_azimuths"

    @cached_property
    def _classes(self) -> tuple[NDArray[np.int64], ...]:
        return self.grid.classes(self.mirrors, all_alike=self.all_alike)

    @property
    def number(self) -> int:
        """Number of classes of directions."""
        return int(self._classes[1].max()) + 1

    @cached_property
    def azimuth(self) -> Array:
        """Azimuth of the first direction of each class (d,) in degrees."""
        first = np.unique(self._classes[1], return_index=True)[1]
        return np.asarray(first * self.grid.width)

    @property
    def of_every(self) -> NDArray[np.int64]:
        """Class of every direction 0, `grid.width`, ... (turns,)."""
        return self._classes[1]

    def folded(self, fields: Array) -> Array:
        """Sums of fields (..., turns, r) over the classes of cells: (..., c, r)."""
        cells = self._classes[0]
        order = np.argsort(cells, kind="stable")
        starts = np.searchsorted(cells[order], np.arange(cells.max() + 1))
        return np.asarray(np.add.reduceat(fields[..., order, :], starts, axis=-2))

    @cached_property
    def weights(self) -> Array:
        """Number per azimuth cell in each direction from the classes' sums (d, c)."""
        cells = self._classes[0]
        if self.all_alike:
            return np.full((1, 1), 1.0 / self.grid.turns)
        edges = self.grid.start + self.grid.width * np.arange(self.grid.turns + 1)
        gap = edges - self.azimuth[:, None]
        share = np.zeros((len(self.azimuth), self.grid.turns))
        # The cells smooth too: with a kernel narrower by that, the second moment is that of the kernel asked for.
        half = math.sqrt(max(self.kernel**2 - self.grid.width**2 / (12.0 * _COSINE_MOMENT), 0.25 * self.kernel**2))
        for turn in (-720.0, -360.0, 0.0, 360.0, 720.0):  # the kernel may reach around
            share += np.diff(_raised_cosine(gap + turn, half), axis=1)
        size = np.bincount(cells)
        spread = np.zeros((self.grid.turns, len(size)))
        spread[np.arange(self.grid.turns), cells] = 1.0 / size[cells]
        return np.asarray(share @ spread)

    @cached_property
    def radial(self) -> _Radial:
        """Smoothing over distance."""
        return _Radial(self.grid)


class _Radial:
    """Places in ln r, and what smooths numbers by distance cell to numbers per ln r there.

    Attributes
    ----------
    places : (j,) float64
        Logarithms of distances in m.
    smooth, slope : (r, j) float64
        Smoothed number per ln r and its derivative, of one fragment in a cell, spread evenly in ln r over it.
    area : (j,) float64
        Ground of an azimuth cell per ln r (m2).
    """

    def __init__(self, grid: PolarGrid) -> None:
        edges = np.log(np.maximum(grid.edges, grid.edges[1] / math.e))
        count = math.ceil((edges[-1] - edges[0] + 4.0 * RADIAL) / SPACING) + 1
        self.places = edges[0] + SPACING * np.arange(count)
        gap = (edges[:, None] - self.places) / RADIAL
        width = np.diff(edges)[:, None]
        self.smooth = np.diff(0.5 * _erf(gap / math.sqrt(2.0)), axis=0) / width
        self.slope = -np.diff(np.exp(-0.5 * gap**2), axis=0) / (width * RADIAL * math.sqrt(2.0 * math.pi))
        self.area = (2.0 * math.pi / grid.turns) * np.exp(2.0 * self.places)


def _raised_cosine(gap: Array, half: float) -> Array:
    """Integral of the raised cosine of unit area from far below to a gap (degrees)."""
    x = np.clip(gap / half, -1.0, 1.0)
    return np.asarray(0.5 * (1.0 + x + np.sin(math.pi * x) / math.pi))


class DensityGroups:
    """Numbers of hazardous fragments by kind, direction class and distance, summed over groups of realisations.

    Groups are independent of each other: one realisation each, or as many as were drawn together. Once memory is full
    neighbouring groups are joined in pairs, so that the fields of any number of realisations take no more than `MEMORY`
    bytes (64 groups at least).

    Parameters
    ----------
    directions : Directions
        Of the densities.
    together : int
        Realisations that are not independent of each other: numbers 0 to `together` - 1, and so on.
    """

    def __init__(self, directions: Directions, together: int = 1) -> None:
        self.directions = directions
        self.size, self.realisations = together, 0  # of a full group; of all
        self._sums: list[Array] = []

    def add(self, landings: Array, tracks: Array) -> None:
        """Add one realisation: numbers and path lengths over height (turns, r) on the grid or up to a nearer reach."""
        here = np.stack([self.directions.folded(values) for values in (landings, tracks)])
        cells = max(here.shape[-1], self.cells)
        if cells > self.cells:
            self._sums = [_padded(one, cells) for one in self._sums]
        here = _padded(here, cells)
        if self.realisations % self.size == 0:
            if len(self._sums) >= max(64, 2 * int(MEMORY / here.nbytes / 2)):
                self._join()
            self._sums.append(here)
        else:
            self._sums[-1] = self._sums[-1] + here
        self.realisations += 1

    def _join(self) -> None:
        self._sums = [one + other for one, other in zip(self._sums[::2], self._sums[1::2], strict=True)]
        self.size *= 2

    @property
    def cells(self) -> int:
        """Distance cells so far."""
        return self._sums[0].shape[-1] if self._sums else 0

    @property
    def sums(self) -> Array:
        """Sums of the groups (g, 2, c, r)."""
        return np.stack(self._sums)

    @property
    def sizes(self) -> NDArray[np.int64]:
        """Realisations of every group (g,)."""
        sizes = np.full(len(self._sums), self.size)
        sizes[-1] -= self.size * len(self._sums) - self.realisations
        return sizes

    @classmethod
    def of(cls, directions: Directions, sums: Array, sizes: NDArray[np.int64] | None = None) -> DensityGroups:
        """Groups whose folded sums (g, 2, c, r) are known."""
        made = cls(directions)
        made._sums = list(sums)
        made.size = 1 if sizes is None else int(sizes[0])
        made.realisations = len(sums) if sizes is None else int(sizes.sum())
        return made


def _padded(values: Array, cells: int) -> Array:
    empty = [(0, 0)] * (values.ndim - 1) + [(0, cells - values.shape[-1])]
    return np.pad(values, empty)


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
        Bound of the bias of taking the worst direction.
    azimuth, by_direction, upper_by_direction : (k,) float64
        Directions all around (degrees), the distance in each, and its one-sided 95 % bound in that direction (NaN for
        a single realisation), neither beyond the distance and the bound above. Over all azimuths one entry.
    radius : (j,) float64
        Places of the curves.
    density, density_low, density_high : (2, j) float64
        Expected density on the ground and normal to the path (1/m2) over all azimuths or in the worst direction, and
        5 and 95 % of the bootstrap's draws: the certainty of the mean, not the scatter of single events.
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


def expected_distance(
    groups: DensityGroups, limit: float, *, draws: int = DRAWS, seed: int = 0, every_direction: bool = True
) -> ExpectedDistance:
    """Estimate the distance at which the expected density falls below `limit` (1/m2) for the last time.

    Parameters
    ----------
    groups : DensityGroups
        Fields of the realisations.
    limit : float
        Acceptable density (1/m2).
    draws : int
        Of the bootstrap.
    seed : int
        Of the bootstrap.
    every_direction : bool
        Bounds of every direction and of the density too, not of the distance alone.

    Raises
    ------
    InputError
        There is no realisation.
    """
    require_number("hazard", "limit", limit, "1/m2")
    if not groups.realisations:
        raise InputError("hazard: no realisation to assess")
    return _Estimate(groups, limit, draws, seed).result(every_direction=every_direction)


def drawn_distances(groups: DensityGroups, limit: float, *, draws: int = DRAWS, seed: int = 0) -> tuple[float, Array]:
    """The distance over all azimuths (m), and in every draw of the bootstrap (b,); as `expected_distance`.

    Draws of the same seed take the same realisations: differences between ensembles of the same random numbers are
    then known better than the distances themselves.
    """
    found = _Estimate(groups, limit, draws, seed)
    result = found.result(every_direction=False)
    reach = np.log([max(one, 1e-300) for one in (result.ground, result.normal)])[:, None]
    return result.distance, np.exp(found._draws_of(reach, 0))


class _Estimate:
    """One estimate: fields, places and draws, and the distances from them.

    Fields are smoothed over distance first, group by group: all that follows is linear in them up to the density.
    """

    def __init__(self, groups: DensityGroups, limit: float, draws: int, seed: int) -> None:
        self.directions, self.limit = groups.directions, limit
        self.sums, self.sizes = groups.sums, groups.sizes  # (g, 2, c, r)
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
        """All places up to the farthest fragment."""
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
        places = self.radial.places[where]
        above = density >= self.limit
        reached = above.any(axis=-1)
        last = np.minimum(len(places) - 1 - np.argmax(above[..., ::-1], axis=-1), len(places) - 2)
        with np.errstate(divide="ignore", invalid="ignore"):
            here, there = (
                np.log(np.take_along_axis(density, at[..., None], axis=-1)[..., 0] / self.limit)
                for at in (last, last + 1)
            )
            share = np.clip(here / (here - there), 0.0, 1.0)
        return np.asarray(np.where(reached, places[last] + np.nan_to_num(share) * SPACING, -np.inf))

    def _around(self, *centres: float) -> slice:
        """Places about distances (ln r)."""
        known = [one for one in centres if math.isfinite(one)]
        if not known:
            return self.everywhere
        begin, end = np.searchsorted(self.radial.places, [min(known) - INSIDE, max(known) + BEYOND])
        return slice(min(int(begin), self.last - 2), min(int(end), self.last))

    def result(self, *, every_direction: bool) -> ExpectedDistance:
        """Distances, bound and curves."""
        number = np.einsum("dc,kcr->kdr", self.weights, self.total) / self.count  # (2, d, r)
        here = self.everywhere
        found = self._through(self._density(self._smoothed(number, here), here), here)  # (2, d)
        larger = found.max(axis=0)
        worst = int(np.argmax(larger))
        plain = float(larger[worst])
        crossed = self._cross_fitted(larger) if len(larger) > 1 and self.several else plain
        middle = 0.5 * (math.exp(plain) + math.exp(crossed))
        error, upper = None, None
        each = np.full(len(larger), np.nan)
        if self.several:
            groups = len(self.sizes)
            factor = math.sqrt(groups / (groups - 1))
            near = larger >= plain - NEAR_WORST
            drawn = {d: self._draws_of(found, d) for d in np.flatnonzero(near | every_direction).tolist()}
            spread = _spread(np.max([drawn[d] for d in np.flatnonzero(near).tolist()], axis=0)) * factor
            error, bound = middle * spread, _student(groups - 1)
            upper = middle * math.exp(bound * spread)
            for d, draws in drawn.items():
                each[d] = math.exp(larger[d] + bound * _spread(draws) * factor)
            if not middle > 0.0:
                error, upper = self._where_none(drawn)
            each[each > upper], each[worst] = upper, upper  # the headline bounds every direction
        mean = self._density(self._smoothed(number[:, worst], here), here)
        low, high = self._band(worst) if every_direction and self.several else (mean[:, :0], mean[:, :0])
        all_alike = self.directions.all_alike
        reach = np.minimum(np.exp(larger), middle)
        of_every = np.zeros(1, dtype=np.int64) if all_alike else self.directions.of_every
        return ExpectedDistance(
            middle, upper, error, float(np.exp(found[0].max())), float(np.exp(found[1].max())), self.directions.basis,
            None if all_alike else float(self.directions.azimuth[worst]), self.count, len(self.sizes),
            None if all_alike else self.directions.kernel, self.directions.mirrors,
            0.5 * abs(math.exp(plain) - math.exp(crossed)),
            self.directions.grid.width * np.arange(len(of_every)), reach[of_every], each[of_every],
            np.exp(self.radial.places[here]), mean, low, high,
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

    def _draws_of(self, found: Array, direction: int) -> Array:
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


_erf = np.vectorize(math.erf, otypes=[np.float64])


def _student(freedom: int) -> float:
    """95 % quantile of Student's distribution: Cornish-Fisher about the normal quantile (4 digits from 5 on)."""
    z, v = 1.6448536269514722, float(max(freedom, 1))
    return (
        z
        + (z**3 + z) / (4.0 * v)
        + (5.0 * z**5 + 16.0 * z**3 + 3.0 * z) / (96.0 * v**2)
        + (3.0 * z**7 + 19.0 * z**5 + 17.0 * z**3 - 15.0 * z) / (384.0 * v**3)
    )
