"""Exposed sites in the open beside rounds whose nose may point anywhere: the worst direction of the nose for each.

A flight of a turned arrangement has its nose to azimuth 0. Over flat ground in still air its nose pointing elsewhere
is the same flight seen from another azimuth, so that the densities at a site for every direction of the nose are those
of one flight at all azimuths. They are taken from the cells of azimuth and distance of the hazard distance, averaged
over each piece of a site and, in azimuth, over the same kernel. Bounds are those of `fragfield.hazard.exposed`, with
the variance of the weights of single hits bounded from above by their largest.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.scene.plan import contains
from fragfield.hazard.exposed import ExposedSums, sum_bound
from fragfield.hazard.verdict import part_of_criterion

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight.fluence import PolarGrid
    from flight.hazard.density.distance import ExpectedDistance
    from flight.hazard.ensemble import EnsembleHazard
    from flight.hazard.exposed import Prism
    from fragfield.case import CaseTable
    from fragfield.case.conversion.exposed_sites import ExposedSite

    Array = NDArray[np.float64]
    Fields = tuple[Array, Array]


_ACROSS = 24  # points across a piece, at most


@dataclass(frozen=True, eq=False)
class _Piece:
    """Cells that a piece of a site covers, and their weights (1/m2) in its mean density, before the nose turns."""

    turn: NDArray[np.integer[Any]]
    distance: NDArray[np.integer[Any]]
    weight: Array
    longest: float  # of a path in it (m)

    def largest(self, turns: int, *, alike: bool) -> float:
        """Largest weight (1/m2) of what one fragment adds to a cell."""
        if alike:  # the mean over azimuths
            return float(np.bincount(self.distance, weights=self.weight).max(initial=0.0)) / turns
        return float(self.weight.max(initial=0.0))

    def densities(self, values: Array) -> Array:
        """Mean density (turns,) of a field (turns, r), by the azimuth cells through which the nose has turned."""
        inside = self.distance < values.shape[1]
        turns = np.arange(len(values))
        cells = values[(self.turn[inside, None] + turns) % len(values), self.distance[inside, None]]
        return np.asarray((self.weight[inside, None] * cells).sum(axis=0))


@dataclass(eq=False)
class TurnedSums(ExposedSums):
    """Sums over realisations of one attitude of mixed ones, as `ExposedSums`."""

    case: CaseTable | None = None
    """As turned."""
    grid: PolarGrid | None = None
    """Of the fields."""
    kernel: float = 10.0
    """Half-width of the azimuth kernel (degrees)."""
    alike: bool = False
    """Whether all azimuths are alike: then the mean over them is taken."""
    _pieces: list[_Piece] = field(default_factory=list)
    _fields: list[list[Array]] = field(default_factory=list)  # by piece: sums and sums of squares (2 kinds, turns)

    def __post_init__(self) -> None:
        """Find the cells of every piece."""
        assert self.case is not None
        assert self.grid is not None
        origin = np.asarray(self.case.flight.origin, dtype=np.float64)
        for site in self.sites:
            self._pieces += [_piece(prism, origin, self.grid, self.kernel) for prism in site.prisms]
        shape = (2, self.grid.azimuth_cells)
        self._fields = [[np.zeros(shape), np.zeros(shape)] for _ in self._pieces]

    def add_fields(self, fields: Fields, short: Fields | None = None) -> None:
        """Add the fields (landings and tracks) of one realisation, and those without ricochet."""
        if short is not None:
            self._short = self._short or TurnedSums(
                self.sites, case=self.case, grid=self.grid, kernel=self.kernel, alike=self.alike
            )
            assert isinstance(self._short, TurnedSums)
            self._short.add_fields(short)
        for piece, (sums, squares) in zip(self._pieces, self._fields, strict=True):
            for kind, values in enumerate(fields):
                found = piece.densities(values)
                found = np.full_like(found, found.mean()) if self.alike else found
                sums[kind] += found
                squares[kind] += found**2
        self.realisations += 1

    def _largest_energy(self, pieces: range) -> float | None:
        del pieces
        return None  # fields count what is hazardous, not how much

    def _values(
        self,
        case: CaseTable,
        site: ExposedSite,
        pieces: range,
        found: EnsembleHazard,
        expected: ExpectedDistance | None,
    ) -> dict[str, Any]:
        del case, found, expected
        height = site.prisms[0].height
        ground = [self._worst_turn(index, 0, 1.0) for index in pieces]
        normal = [self._worst_turn(index, 1, max(self._pieces[index].longest / height, 1.0)) for index in pieces]
        return self._of_densities(site, normal, ground)

    def _worst_turn(self, index: int, kind: int, largest: float) -> dict[str, float | None]:
        """Largest estimate over the directions of the nose with its standard error, and the largest of the bounds.

        `largest`: that a single fragment adds to a cell, before its weight.
        """
        n, (sums, squares) = self.realisations, self._fields[index]
        total, between = sums[kind], squares[kind]
        spread = n / (n - 1) * np.maximum(between - total**2 / n, 0.0) if n > 1 else np.zeros_like(total)
        most = largest * self._pieces[index].largest(len(total), alike=self.alike)
        bounds = [sum_bound(one, max(most * one, wide), most) for one, wide in zip(total, spread, strict=True)]
        worst = int(np.argmax(total))
        error = math.sqrt(float(spread[worst])) / n if n > 1 else None
        return {"expected": float(total[worst]) / n, "upper": max(bounds) / n, "standard_error": error}


def worst_of_attitudes(entries: Sequence[tuple[tuple[float, float], list[dict[str, Any]]]]) -> list[dict[str, Any]]:
    """For every site its entry in the attitude in which least is left to its criterion, with that attitude.

    `entries`: inclination and roll (degrees), and the entries `exposed` of summary.json, of every attitude that was
    flown.
    """
    worst = []
    for of_site in zip(*(rows for _, rows in entries), strict=True):
        parts = [np.inf if (part := part_of_criterion(one)) is None else part for one in of_site]
        at = int(np.argmax(parts))
        inclination, roll = entries[at][0]
        worst.append({**of_site[at], "worst_inclination_deg": inclination, "worst_roll_deg": roll})
    return worst


def _piece(prism: Prism, origin: Array, grid: PolarGrid, kernel: float) -> _Piece:
    """Cells of a piece by points spread over it, smoothed in azimuth by a raised cosine."""
    x, y = (prism.corners - origin).mean(axis=0).tolist()
    towards, away = math.atan2(y, x), math.hypot(x, y)
    axes = np.array([[x, -y], [y, x]]) / away if away > 0.0 else np.eye(2)  # along the way from the origin, and across
    corners = (prism.corners - origin) @ axes
    low, high = corners.min(axis=0), corners.max(axis=0)
    steps = (np.arange(_ACROSS) + 0.5) / _ACROSS
    x, y = np.meshgrid(*(low[:, None] + (high - low)[:, None] * steps))
    points = np.column_stack([x.ravel(), y.ravel()])
    points = points[contains(corners, points)]
    distance = np.hypot(points[:, 0], points[:, 1])
    reach = grid.up_to(max(grid.reach, float(distance.max()) + grid.cell))
    turn, cell = reach.cells_of(np.degrees(np.arctan2(points[:, 1], points[:, 0]) + towards), distance)
    flat, count = np.unique(turn * len(reach.edges) + cell, return_counts=True)
    turn, cell = flat // len(reach.edges), flat % len(reach.edges)
    inner, outer = reach.edges[cell], reach.edges[cell + 1]
    area = 0.5 * math.radians(grid.width) * (outer**2 - inner**2)
    around = np.arange(-int(kernel / grid.width), int(kernel / grid.width) + 1)
    cosine = 1.0 + np.cos(np.pi * around * grid.width / kernel)
    spread = (turn[:, None] + around) % grid.azimuth_cells
    weight = (count / count.sum() / area)[:, None] * cosine / cosine.sum()
    both, which = np.unique(spread * len(reach.edges) + cell[:, None], return_inverse=True)
    summed = np.bincount(which.ravel(), weights=weight.ravel()).astype(np.float64)
    across = max(float(np.hypot(outer - inner, math.radians(grid.width) * outer).max()), prism.longest)
    return _Piece(both // len(reach.edges), both % len(reach.edges), summed, across)
