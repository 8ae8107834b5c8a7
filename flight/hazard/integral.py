"""The expected density of hazardous fragments as an integral, without random numbers.

Over flat ground in still air, and where fragments do not strike each other, the expected density is linear in the
intensity of the fragments: an integral over mass, position on the casing, direction, and the slopes of the ground
that ricochets meet. It is summed over the points of a lattice rule, each the flight of one weighted fragment:

    q(r) = sum_i w_i l_i(r) / (H A(r)),   w_i = n_i g(e_i | i) / (N p(e_i)).

The point i has a mass and a ring of the casing with the number n_i of fragments; its elevation e_i is taken from a
fixed density p(e) that is high near the level, where distances are decided; g(e | i) is the density of the elevation
of the ring's fragments under the scatter of their directions. l_i(r) is the length of its path below the
height H of a person in the ring of distance r of area A. Directions scatter as `transition` draws them; where
the axis is not vertical, g is that of every azimuth, so that each flight counts in all directions at once.

The rule is an embedded lattice of Cools, Kuo and Nuyens (SIAM J. Sci. Comput. 28 (2006) 2162), shifted `SHIFTS` times
by fixed shifts; their scatter is the error of the quadrature, and takes the place of that over realisations.
"""

from __future__ import annotations

import math
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache, cached_property, lru_cache
from typing import TYPE_CHECKING, Protocol

import numpy as np

from flight.arguments import require_number
from flight.drag import Drag
from flight.hazard.density.density_counts import DensityGroups
from flight.hazard.density.expected import expected_distance
from flight.scene.air import STANDARD_GRAVITY, StandardAtmosphere
from flight.scene.ricochet import Ricochet
from fragfield_base.cores import cores

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight.hazard.criteria import Criteria
    from flight.hazard.density.directions import Directions
    from flight.hazard.density.expected import ExpectedDistance
    from flight.scene.air import Air

    Array = NDArray[np.float64]


POINTS = 8192
"""Points of a lattice: a power of two up to 2^20."""
SHIFTS = 8
_AT_ONCE = 8192  # points whose launches are made together
EXTENSION = 4.0  # of a grid, where fragments come to rest beyond it
SMALLEST_SCATTER = math.radians(1.0)
"""Standard deviation of directions below which elevations are too sharp for the points of the rule."""
LEVEL = 0.05
"""Probability with which an event throws a fragment beyond `Integral.throw`."""
_VECTOR = np.array([1, 182667, 469891, 498753, 110745, 446247, 250185, 118627], dtype=np.uint64)
_SLOPES = len(_VECTOR) - 4  # impacts with a slope of their own
_CURVES = ((math.radians(1.0), 0.7), (math.radians(15.0), 0.3))
"""Half-widths (rad) and fractions of the Lorentz curves about the level that the elevations of the points follow."""
_GAUSS = np.polynomial.legendre.leggauss(14)  # densities to 1e-7 where they are not negligible
_TABLE = 720  # steps of polar angles over half a turn
_FARTHEST = 6.0  # standard deviations of a facet's slope


class Source(Protocol):
    """The intensity of the fragments of one round of revolution."""

    @property
    def axis(self) -> Sequence[float]:
        """Unit vector."""
        ...

    @property
    def place(self) -> Sequence[float]:
        """Point on the axis from which stations count (m)."""
        ...

    @property
    def scatter(self) -> float:
        """Standard deviation of the directions about each of two axes (rad)."""
        ...

    @property
    def shape_factor(self) -> float:
        """K of the presented areas (kg/m3)."""
        ...

    def at(self, points: Array) -> tuple[Array, Array, Array, Array, Array, Array]:
        """Rings of its casing with their fragments, at points (n, 3) of the unit cube, whose measure is the intensity.

        Returns
        -------
        number, mass, radius, station, radial, axial : (n,) float64
            Fragments for which each point stands: the mean over points of the unit cube is the number of all; their
            mass (kg); distance from the axis, and along it from `place` (m); components of the velocity (m/s), before
            its direction scatters.
        """
        ...


@dataclass(frozen=True, eq=False)
class Integral:
    """Expected numbers of fragments by class of direction and distance.

    Attributes
    ----------
    directions : Directions
        Of the densities.
    fields : (2, s, 2, a, r) float64
        Hazardous landings, and paths over height, by cell of azimuth and distance and by shift s of the rule: of whole
        flights, and, unless the distance alone was wanted, before their first impact on the ground. Where all azimuths
        are alike a is one.
    criteria : Criteria
        What was counted.
    rest : (r,) float64
        All fragments by the distance at which they come to rest; empty where they are not flown so far.
    hazardous, hazardous_error : float
        Fragments that are hazardous where they first land, and its standard error by the shifts.
    method : "integral" or "weighted_fragments"
        Whether they were integrated by `integrate`, or are those of `flight.hazard.weighted`.
    """

    directions: Directions
    fields: Array
    criteria: Criteria
    rest: Array
    hazardous: float
    hazardous_error: float
    method: str = "integral"

    def expected(self) -> ExpectedDistance:
        """The hazard distance; its standard error and bound are those of the quadrature."""
        whole, *short = (
            expected_distance(
                DensityGroups.of(self.directions, fields if self.directions.axisymmetric else self._folded(fields)),
                self.criteria.density,
            )
            for fields in self.fields
        )
        return replace(whole, without_ricochet=short[0]) if short else whole

    def _folded(self, fields: Array) -> Array:
        return np.stack([self.directions.folded(one) for one in fields])

    @cached_property
    def throw(self) -> float:
        """Distance (m) beyond which 5 % of events throw a fragment: 1 - exp(-number beyond) is 0.05 there.

        Numbers beyond a distance are those of a Poisson process. NaN where fragments are not flown to rest.
        """
        if not self.rest.size:
            return math.nan
        beyond = np.append(np.cumsum(self.rest[::-1])[::-1], 0.0)
        edges = self.directions.grid.holding(len(self.rest)).edges[: len(beyond)]
        limit = -math.log1p(-LEVEL)
        last = int(np.flatnonzero(beyond > limit)[-1]) if (beyond > limit).any() else -1
        if last < 0:
            return 0.0
        return float(edges[last] + (beyond[last] - limit) / self.rest[last] * (edges[last + 1] - edges[last]))


def integrate(
    source: Source, directions: Directions, criteria: Criteria, *, air: Air | None = None,
    drag: Drag | str | float = "shell_fragment", gravity: float = STANDARD_GRAVITY, ground: float = 0.0,
    ricochet: Ricochet | str | None = "soft_soil", origin: tuple[float, float] = (0.0, 0.0),
    points: int = POINTS, distance_alone: bool = False, threads: int | None = None,
) -> Integral:  # fmt: skip
    """Integrate the expected density of hazardous fragments of one round over flat ground in still air.

    Parameters
    ----------
    source : Source
        Its intensity. Its axis stands within a metre of the origin.
    directions : Directions
        In which densities are wanted; their grid is extended where fragments come to rest beyond it. "all_azimuths" is
        for a vertical axis through the origin.
    criteria : Criteria
        What counts.
    air, drag, gravity, ground, ricochet, origin
        As of `flight.fly`.
    points : int
        Points of each of the shifted rules: a power of two up to 2^20.
    distance_alone : bool
        No fragment is flown farther than where it may be hazardous again: `rest` is empty, `throw` NaN, and there is no
        distance without ricochet.
    threads : int, optional
        Default: all cores this process may use. The result does not depend on it.

    Raises
    ------
    InputError
        An argument is out of range.
    """
    from flight.kernels import motion, weighted

    require_number("integrate", "gravity", gravity, "m/s2", above=0.0)
    require_number("integrate", "points", points, "", low=2.0, high=float(2**20))
    require_number("integrate", "scatter", source.scatter, "rad", low=SMALLEST_SCATTER)
    drag, law = Drag.of(drag), Ricochet.of(ricochet)
    around = motion.Surroundings(
        *(air or StandardAtmosphere()).table(), *drag.table(), np.zeros((0, 9)), ground, float(gravity)
    )
    near = criteria.fluence_grid(directions.grid).table()
    scatter = _scatter(source, directions, origin)
    shape = (weighted.QUANTITIES, directions.grid.shape[1], 1 if directions.axisymmetric else directions.grid.shape[0])

    together = max(1, min(SHIFTS, _AT_ONCE // points))

    def shifted(first: int) -> list[tuple[Array, Array]]:
        rule = _rule(points, first, min(first + together, SHIFTS))
        launches, slopes = _launches(source, directions, rule, ground), rule[3]
        made = []
        for part in range(len(launches) // points):
            counts, moments = np.zeros(shape), np.zeros(shape)
            rows = slice(part * points, (part + 1) * points)
            weighted.fly_weighted(
                launches[rows], slopes[rows], ground, around, Ricochet.table([law])[0], near, scatter, counts, moments,
                not distance_alone,
            )  # fmt: skip
            made.append((counts, moments))
        return made

    with ThreadPoolExecutor(threads or cores()) as pool:
        parts = [part for made in pool.map(shifted, range(0, SHIFTS, together)) for part in made]
    integral = _whole(parts, directions, criteria, distance_alone=distance_alone)
    if integral.fields[..., -1].any() or integral.rest[-1:].any():  # whatever is farther away is counted there
        farther = replace(directions, grid=directions.grid.up_to(EXTENSION * directions.grid.reach))
        return integrate(
            source, farther, criteria, air=air, drag=drag, gravity=gravity, ground=ground, ricochet=law, origin=origin,
            points=points, distance_alone=distance_alone, threads=threads,
        )  # fmt: skip
    return integral


def _whole(
    parts: list[tuple[Array, Array]], directions: Directions, criteria: Criteria, *, distance_alone: bool
) -> Integral:
    from flight.kernels import weighted as w

    fields = np.stack([_moved(counts, moments, np.diff(directions.grid.edges)) for counts, moments in parts])
    first = fields[:, [w.LANDINGS, w.PATHS]]
    whole = first + fields[:, [w.LANDINGS_AFTER, w.PATHS_AFTER]]
    rest = fields[:, w.REST].mean(axis=0).sum(axis=0)
    hazardous = first[:, 0].sum(axis=(1, 2))
    error = float(hazardous.std(ddof=1) / math.sqrt(len(hazardous)))
    return Integral(
        directions, np.stack([whole] if distance_alone else [whole, first]), criteria,
        rest[:0] if distance_alone else rest, float(hazardous.mean()), error,
    )  # fmt: skip


def _moved(counts: Array, moments: Array, width: Array) -> Array:
    """Numbers (q, a, r) moved outward by the distances of their launches, to first order: they have the mean shift."""
    counts, moments = np.moveaxis(counts, 1, 2), np.moveaxis(moments, 1, 2)
    density = moments / width
    across = np.zeros((*counts.shape[:2], counts.shape[2] + 1))
    across[..., 1:-1] = 0.5 * (density[..., :-1] + density[..., 1:])
    return np.asarray(counts - np.diff(across, axis=-1))


@lru_cache(maxsize=SHIFTS)
def _rule(points: int, first: int, last: int) -> tuple[Array, Array, Array, Array]:
    """Points (n, 3) for the source, elevations (n,) in rad, weights over densities (n,), slopes: of several shifts."""
    lattice = np.concatenate([_lattice(points, shift) for shift in range(first, last)])
    elevation, per_angle = _elevations(lattice[:, 3])
    return lattice[:, :3], elevation, 1.0 / (points * per_angle), _normals(lattice[:, 4 : 4 + _SLOPES])


def _lattice(points: int, shift: int) -> Array:
    """Points (n, 8) of the lattice rule, shifted by multiples of irrational numbers."""
    number = np.arange(points, dtype=np.uint64)[:, None]
    exact = (number * _VECTOR) % np.uint64(points)
    roots = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0, 19.0])
    return np.asarray((exact / points + shift * roots + shift / (SHIFTS * points)) % 1.0)


def _launches(source: Source, directions: Directions, rule: tuple[Array, Array, Array, Array], ground: float) -> Array:
    """Launches for the kernel."""
    from flight.kernels import weighted

    points, elevation, weight, _ = rule
    number, mass, radius, station, radial, axial = source.at(points)
    speed = np.hypot(radial, axial)
    polar = np.arctan2(np.abs(radial), axial)
    up = source.axis[2]
    launches = np.zeros((len(points), weighted.LAUNCH_COLUMNS))
    launches[:, 0] = mass
    launches[:, 1] = 0.5 * (mass / source.shape_factor) ** (2.0 / 3.0) / mass
    number = number * weight
    # How high a fragment starts that flies at this elevation without scatter.
    with np.errstate(divide="ignore", invalid="ignore"):
        upward = np.where(radial != 0.0, (np.sin(elevation) - np.cos(polar) * up) / np.sin(polar), 0.0)
    steepest = math.sqrt(max(1.0 - up * up, 0.0))
    height = source.place[2] + station * up + radius * np.clip(upward, -steepest, steepest)
    launches[:, 3] = np.maximum(height - ground, 1e-9)
    launches[:, 4], launches[:, 5] = np.maximum(speed, 1e-6), elevation
    if directions.axisymmetric:
        density = np.empty(len(points))
        nodes, weights = _GAUSS
        weighted.scattered_density(
            np.arccos(np.cos(polar) * np.sign(up)), 0.5 * math.pi - elevation, source.scatter, 0.5 * (1.0 + nodes),
            0.5 * weights, density,
        )  # fmt: skip
        launches[:, 2] = radius * np.sign(radial)
        number = number * density * 2.0 * math.pi * np.cos(elevation)
    launches[:, 6], launches[:, 7] = number, polar
    launches[:, 8], launches[:, 9] = station, radius
    return launches


def _elevations(quantiles: Array) -> tuple[Array, Array]:
    """Elevations (rad) of the rule's points at quantiles of a mixture, and its density (1/rad)."""
    elevation, density, begin = np.zeros(len(quantiles)), np.zeros(len(quantiles)), 0.0
    for width, share in _CURVES:
        mine = (quantiles >= begin) & (quantiles < begin + share)
        end = math.atan(0.5 * math.pi / width)
        elevation[mine] = width * np.tan(end * (2.0 * (quantiles[mine] - begin) / share - 1.0))
        begin += share
    for width, share in _CURVES:
        density += share * width / (2.0 * math.atan(0.5 * math.pi / width) * (width**2 + elevation**2))
    return elevation, density


def _normals(quantiles: Array) -> Array:
    """Normal variates at quantiles, by the inverse of their distribution between its ends."""
    grid = np.linspace(-_FARTHEST, _FARTHEST, 24001)
    below = 0.5 * (1.0 + _erf(grid / math.sqrt(2.0)))
    return np.asarray(np.interp(quantiles, below, grid))


_erf = np.vectorize(math.erf, otypes=[np.float64])


def _scatter(source: Source, directions: Directions, origin: tuple[float, float]) -> tuple[Array | float, ...]:
    from flight.kernels.weighted import Scatter

    grid, (x, y, up) = directions.grid, source.axis
    azimuths = np.zeros((0, 2))
    if not directions.axisymmetric:
        inside = 0.5 + np.array([-0.5, 0.5]) / math.sqrt(3.0)
        azimuths = np.radians(grid.start + grid.width * (np.arange(grid.azimuth_cells)[:, None] + inside))
    table = np.zeros((2, 2)) if directions.axisymmetric else _scatter_table(source.scatter)
    cosine, sine = np.cos(azimuths), np.sin(azimuths)
    away = (source.place[0] - origin[0]) * cosine + (source.place[1] - origin[1]) * sine
    return Scatter(table, math.pi / _TABLE, up, azimuths, x * cosine + y * sine, away, math.radians(grid.width))


@cache
def _scatter_table(scatter: float) -> Array:
    """Densities (1/sr) by polar angle before and after the scatter."""
    from flight.kernels import weighted

    angles = np.linspace(0.0, math.pi, _TABLE + 1)
    before, after = (one.ravel() for one in np.meshgrid(angles, angles, indexing="ij"))
    found = np.empty(before.size)
    nodes, weights = _GAUSS
    weighted.scattered_density(before.copy(), after.copy(), scatter, 0.5 * (1.0 + nodes), 0.5 * weights, found)
    return found.reshape(len(angles), -1)
