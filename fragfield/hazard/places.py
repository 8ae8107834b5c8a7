"""Densities of hazardous fragments at places of the size of a person or a vehicle, over the whole ground.

The ground about the origin is cut once into places, whole cells of azimuth and distance, whatever the sites are: so a
larger site holds every place of a smaller one within it, and is never better. What fragments do below a person's height
is counted in all of them by every flight; a site only asks for the places that it touches.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from flight.fluence import PolarGrid
from flight.scene.targets import contains
from fragfield.results.site import Estimate

Array = NDArray[np.float64]
Integers = NDArray[np.int64]


SMALLEST, LARGEST, RELATIVE = 1.0, 5.0, 0.1  # m, m, and of the distance: width of a place, where cells are no wider
LEVEL = 0.95
_ACROSS = 8  # points across a place, by which the ground that obstacles cover is found
_MIN_FREE = 0.25  # of a place, to which the density is referred at least: a narrower strip holds no person


def sum_bound(total: Array, variance: Array, largest: Array, level: float = LEVEL) -> Array:
    """One-sided upper bounds, at `level`, of the expected values of sums of weights over independent rare events.

    `total` is the sum of the weights, `variance` that of their squares (or an estimate of the sum's variance); no
    weight is above `largest`. Where hits come in bundles an event is the bundle, and its weight that of all its hits.
    Fay and Feuer 1997: (v + w^2) / (y + w) times the gamma quantile of shape (y + w)^2 / (v + w^2).
    """
    from scipy.special import gammaincinv

    mean, wide = total + largest, variance + largest**2
    return np.asarray(wide / mean * gammaincinv(mean**2 / wide, level))


class Places:
    """Places about the origin.

    `of_cells` (a, r): place of every cell of azimuth and distance; `ring` (p,): number of the ring of distances in
    which a place lies; `cells` (p,): cells of azimuth that it is wide; `corners` (p, 4, 2) of a plan that holds it,
    from the origin (m); `area` (p,) of its ground (m2).
    """

    def __init__(self, grid: PolarGrid) -> None:
        edges, count, width = grid.edges, grid.azimuth_cells, math.radians(grid.width)
        ring, starts = np.zeros(len(edges) - 1, dtype=np.int64), [0.0]
        for cell in range(1, len(ring)):
            if edges[cell] - starts[-1] >= _size(edges[cell]) - 1e-9:
                starts.append(edges[cell])
            ring[cell] = len(starts) - 1
        ends = np.append(starts[1:], edges[-1])
        divisors = np.array([one for one in range(1, count + 1) if count % one == 0])
        group = np.array([divisors[(divisors * width * end <= _size(end)) | (divisors == 1)].max() for end in ends])
        first = np.concatenate([[0], np.cumsum(count // group)])
        self.of_cells = first[ring] + np.arange(count)[:, None] // group[ring]
        self.ring = np.repeat(np.arange(len(starts)), count // group)
        self.cells = group[self.ring]
        turn = math.radians(grid.start) + (np.arange(first[-1]) - first[self.ring]) * self.cells * width
        self._spans = np.array(starts)[self.ring], ends[self.ring], turn, self.cells * width
        near, far, turn, angle = self._spans
        self.area = 0.5 * angle * (far**2 - near**2)
        rim = far / np.cos(0.5 * angle)
        sides = [(near, turn), (rim, turn), (rim, turn + angle), (near, turn + angle)]
        self.corners = np.stack([np.column_stack([r * np.cos(t), r * np.sin(t)]) for r, t in sides], axis=1)

    def centre(self, place: int) -> Array:
        """Of a place (2,)."""
        near, far, turn, angle = (one[place] for one in self._spans)
        return 0.5 * (near + far) * np.array([math.cos(turn + 0.5 * angle), math.sin(turn + 0.5 * angle)])

    def touched(self, pieces: Sequence[Array]) -> Integers:
        """Places that share a point with one of the convex polygons (k, 2)."""
        import shapely

        outlines = shapely.polygons(self.corners)
        return np.flatnonzero(np.any([shapely.intersects(outlines, shapely.Polygon(one)) for one in pieces], axis=0))

    def free(self, chosen: Integers, plans: Sequence[Array]) -> Array:
        """Fraction of the chosen places that no plan (k, 2) of an obstacle covers."""
        if not plans:
            return np.ones(len(chosen))
        near, far, turn, angle = (one[chosen, None, None] for one in self._spans)
        steps = (np.arange(_ACROSS) + 0.5) / _ACROSS
        away = np.sqrt(near**2 + (far**2 - near**2) * steps[:, None])
        azimuth = turn + angle * steps
        points = np.stack([away * np.cos(azimuth), away * np.sin(azimuth)], axis=-1)
        covered = np.any([contains(plan, points.reshape(-1, 2)) for plan in plans], axis=0)
        return np.asarray(1.0 - covered.reshape(len(chosen), -1).mean(axis=1))


class PlaceSums:
    """Sums over realisations of what passes and lands in every place.

    `grid`: cells of the fields, which go on beyond it where fields do; `height`: below which paths count (m); `spread`
    (a, a): weights by which every field is spread over azimuth first, an even mean where all azimuths are alike, a
    kernel where the direction of the nose is open. With it the worst azimuth at a site's distances counts.
    """

    def __init__(self, grid: PolarGrid, height: float, spread: Array | None = None) -> None:
        self.grid, self.height, self.spread = grid, height, spread
        self.places = Places(grid)
        self.realisations = 0
        self._sums = np.zeros((3, 2, len(self.places.area)))  # sum, sum of squares, largest; landings, paths

    def add(self, landings: Array, paths: Array) -> None:
        """Add the fields (a, r) of one realisation: landings, and lengths of paths over the height."""
        self._hold(max(landings.shape[1], paths.shape[1]))
        for kind, field in enumerate((landings, paths)):
            values = field if self.spread is None else self.spread @ field
            place = self.places.of_cells[:, : field.shape[1]]
            total = np.bincount(place.ravel(), weights=values.ravel(), minlength=len(self.places.area))
            self._sums[0, kind] += total
            self._sums[1, kind] += total**2
            np.maximum(self._sums[2, kind], total, out=self._sums[2, kind])
        self.realisations += 1

    def _hold(self, cells: int) -> None:
        if cells > self.places.of_cells.shape[1]:
            self.places = Places(self.grid.holding(cells))
            more = len(self.places.area) - self._sums.shape[2]
            self._sums = np.pad(self._sums, ((0, 0), (0, 0), (0, more)))

    def worst(self, pieces: Sequence[Array], plans: Sequence[Array]) -> tuple[list[Estimate], Array, int]:
        """Densities (1/m2) on the ground and normal to paths at the worst place that a site touches.

        `pieces`, `plans` (k, 2): convex pieces of the site, and outlines of obstacles, from the origin (m). Returned
        are, of landings and of paths, the largest estimate with its standard error, and the largest of all bounds,
        which bounds the worst place whichever it is; the centre (2,) of the worst place (m); how many places count.
        """
        nearest = float(np.hypot(*np.concatenate(list(pieces)).T).min())
        self._hold(self.grid.up_to(nearest + 2.0 * self.grid.cell).shape[1])
        touched = self.places.touched(pieces)
        free = self.places.free(touched, plans)
        open_ground = free > 0.0 if (free > 0.0).any() else free >= 0.0
        chosen, area = touched[open_ground], self.places.area[touched] * np.maximum(free, _MIN_FREE)
        area = area[open_ground]
        if self.spread is not None:
            chosen = np.flatnonzero(np.isin(self.places.ring, self.places.ring[touched]))
            area = self.places.area[chosen]
        n, sums = self.realisations, self._sums[:, :, chosen]
        corners = self.places.corners[chosen]
        across = ((corners[:, None] - corners[:, :, None]) ** 2).sum(axis=-1).max(axis=(1, 2))
        longest = np.sqrt(across + self.height**2) / self.height
        most = 1.0 if self.spread is None else np.minimum(1.0, self.places.cells[chosen] * self.spread.max())
        single = most * np.stack([np.ones(len(chosen)), longest])  # what one fragment adds to a place at most
        total, squares, largest = sums
        between = n / (n - 1) * np.maximum(squares - total**2 / n, 0.0) if n > 1 else np.zeros_like(total)
        upper = sum_bound(total, np.maximum(between, single * total), np.maximum(single, largest)) / n / area
        expected, error = total / n / area, np.sqrt(between) / n / area
        values = []
        for kind in range(2):
            at = int(np.argmax(expected[kind]))
            spread = float(error[kind, at]) if n > 1 else None
            values.append(
                Estimate(expected=float(expected[kind, at]), upper=float(upper[kind].max()), standard_error=spread)
            )
        worst = int(chosen[np.argmax(expected.max(axis=0))])
        own = touched[self.places.ring[touched] == self.places.ring[worst]]
        return values, self.places.centre(worst if worst in own else int(own[0])), len(touched)


def kernel_weights(grid: PolarGrid, kernel: float) -> Array:
    """Raised cosine of a half-width (degrees) over the cells of azimuth, as weights (a, a)."""
    away = np.arange(grid.azimuth_cells) * grid.width
    away = np.minimum(away, 360.0 - away)
    weight = np.where(away < kernel, 1.0 + np.cos(np.pi * away / kernel), 0.0)
    turns = np.arange(grid.azimuth_cells)
    return np.asarray((weight / weight.sum())[(turns[:, None] - turns) % grid.azimuth_cells])


def _size(distance: float) -> float:
    return min(LARGEST, max(SMALLEST, RELATIVE * distance))
