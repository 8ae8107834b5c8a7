"""Hazard from landings and witness surfaces: densities, hazardous fragment distance, throw, probability of a hit.

A fragment is hazardous with 79 J or more at impact; one hazardous fragment per 55.7 m2 is the acceptable density (DoD
6055.09; DDESB Technical Paper 12). Two densities are given for every cell of azimuth and distance:

ground
    hazardous landings in the cell over the cell's area;
normal
    hazardous fragments per area of a plane normal to their path, which is what a person meets (trajectory-normal
    method). Each fragment counts with the length of its path inside the cell, up to a person's height above the
    ground, over the cell's volume; the end of the path is taken straight and radial, at the angle and with the
    energy of the landing. As the height goes to zero this is the sum of 1 / (area sin(angle)).

The hazardous fragment distance of a sector is the farthest distance at which the density falls through the acceptable
one, linear between the cells' centres (zero beyond the last). One fragment in a narrow near cell already exceeds the
limit, so a distance from a single realisation is noisy: pool several (`realisations`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.result import FlightResult, Status

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from flight.targets import Cylinder, Panel, Polygon

__all__ = ["Criteria", "Hazard", "assess", "by_azimuth", "density_on", "falling_through", "hit_probability"]

SHALLOWEST = math.radians(0.01)  # paths closer to level than this count as this steep


@dataclass(frozen=True)
class Criteria:
    """What counts as a hazard: energy (J), density (1/m2), and the person's area (m2) and height (m)."""

    energy: float = 79.0  # 58 ft lb
    density: float = 1.0 / 55.7  # 1 per 600 ft2
    person_area: float = 0.58
    person_height: float = 1.8

    def __post_init__(self) -> None:
        """Refuse criteria that mean nothing."""
        for name in ("density", "person_area"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) > 0.0):
                raise InputError(f"hazard: {name} is {getattr(self, name)}, needed: above zero")
        for name in ("energy", "person_height"):
            if not (math.isfinite(getattr(self, name)) and getattr(self, name) >= 0.0):
                raise InputError(f"hazard: {name} is {getattr(self, name)}, needed: zero or more")


@dataclass(frozen=True, eq=False)
class Hazard:
    """Hazard by azimuth sector (s of them) and distance (r cells).

    Attributes
    ----------
    azimuth : (s,) float64
        Centres of the sectors (degrees).
    edges : (r + 1,) float64
        Edges of the distance cells (m).
    ground_density, normal_density : (s, r) float64
        Hazardous fragments per area (1/m2), per realisation; see the module.
    all_round_ground, all_round_normal : (r,) float64
        The same, over all azimuths.
    probability : (s, r) float64
        Probability that a person in the cell is hit by a hazardous fragment.
    ground_distance, normal_distance, max_throw : (s,) float64
        Hazardous fragment distance by either density, and farthest landing (m); 0 where there is none.
    fragments, hazardous : (s,) float64
        Landed fragments and hazardous ones, per realisation.
    all_round_ground_distance, all_round_normal_distance : float
        Hazardous fragment distance of the densities over all azimuths (m).
    """

    criteria: Criteria
    realisations: int
    azimuth: NDArray[np.float64]
    edges: NDArray[np.float64]
    ground_density: NDArray[np.float64]
    normal_density: NDArray[np.float64]
    all_round_ground: NDArray[np.float64]
    all_round_normal: NDArray[np.float64]
    probability: NDArray[np.float64]
    ground_distance: NDArray[np.float64]
    normal_distance: NDArray[np.float64]
    max_throw: NDArray[np.float64]
    fragments: NDArray[np.float64]
    hazardous: NDArray[np.float64]
    all_round_ground_distance: float
    all_round_normal_distance: float

    @property
    def distance(self) -> NDArray[np.float64]:
        """Centres of the distance cells (m)."""
        return np.asarray(0.5 * (self.edges[1:] + self.edges[:-1]))

    @property
    def hazardous_fragment_distance(self) -> float:
        """Largest over the sectors and both densities (m)."""
        return float(max(self.ground_distance.max(), self.normal_distance.max()))

    def summary(self) -> dict[str, Any]:
        """Numbers for summary.json: distances over all, and one entry a sector."""
        return {
            "hazardous_fragment_distance": self.hazardous_fragment_distance,
            "hazardous_fragment_distance_ground": float(self.ground_distance.max()),
            "hazardous_fragment_distance_normal": float(self.normal_distance.max()),
            "hazardous_fragment_distance_all_round_ground": self.all_round_ground_distance,
            "hazardous_fragment_distance_all_round_normal": self.all_round_normal_distance,
            "max_range": float(self.max_throw.max()),
            "hazardous_fragments": float(self.hazardous.sum()),
            "realisations": self.realisations,
            "by_sector": [
                {
                    "azimuth_deg": float(azimuth),
                    "fragments": float(fragments),
                    "hazardous": float(hazardous),
                    "max_throw": float(throw),
                    "hazardous_fragment_distance": float(max(ground, normal)),
                    "hazardous_fragment_distance_ground": float(ground),
                    "hazardous_fragment_distance_normal": float(normal),
                }
                for azimuth, fragments, hazardous, throw, ground, normal in zip(
                    self.azimuth, self.fragments, self.hazardous, self.max_throw, self.ground_distance,
                    self.normal_distance, strict=True,
                )
            ],
        }  # fmt: skip


def assess(
    landing: FlightResult | NDArray[Any],
    criteria: Criteria | None = None,
    *,
    sector_width: float = 5.0,
    distance: float | ArrayLike = 10.0,
    realisations: int = 1,
) -> Hazard:
    """Hazard of landed fragments.

    Parameters
    ----------
    landing : FlightResult or structured array of dtype LANDING
        Only rows that landed count. Rows of several realisations may be concatenated.
    criteria : Criteria, optional
        Default: 79 J, 1 per 55.7 m2, a person of 0.58 m2 and 1.8 m.
    sector_width : float
        Width of a sector (degrees), a whole fraction of 360; the first is centred on azimuth 0.
    distance : float or edges
        Width of a distance cell (m), or all edges (m), rising from zero or more.
    realisations : int
        Number of realisations in `landing`; densities and numbers are means over them.
    """
    criteria = criteria or Criteria()
    rows = landing.landing if isinstance(landing, FlightResult) else landing
    rows = rows[rows["status"] == Status.LANDED]
    if realisations < 1:
        raise InputError(f"hazard: realisations is {realisations}, needed: 1 or more")
    sector, sectors, centres = _sectors(rows["azimuth"], sector_width)
    throw = np.zeros(sectors)
    np.maximum.at(throw, sector, rows["distance"])
    edges = _edges(distance, float(throw.max()))
    dangerous = rows["energy"] >= criteria.energy
    area = np.outer(np.full(sectors, math.pi / sectors), np.diff(edges**2))
    numbers, tracks = _pile(rows[dangerous], sector[dangerous], sectors, edges, criteria.person_height)
    ground, normal = numbers / area / realisations, tracks / area / realisations
    share = area / area.sum(axis=0)
    all_ground, all_normal = (share * ground).sum(axis=0), (share * normal).sum(axis=0)
    middle = 0.5 * (edges[1:] + edges[:-1])

    def distances(density: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.array([falling_through(middle, row, criteria.density, float(edges[-1])) for row in density])

    return Hazard(
        criteria, realisations, centres, edges, ground, normal, all_ground, all_normal,
        hit_probability(normal, criteria.person_area), distances(ground), distances(normal), throw,
        np.bincount(sector, minlength=sectors) / realisations,
        np.bincount(sector[dangerous], minlength=sectors) / realisations,
        float(distances(all_ground[None])[0]), float(distances(all_normal[None])[0]),
    )  # fmt: skip


def hit_probability(density: ArrayLike, person_area: float = 0.58) -> NDArray[np.float64]:
    """Probability p = 1 - exp(-q A) of a hit on a person of area A (m2) at a trajectory-normal density q (1/m2)."""
    return np.asarray(-np.expm1(-person_area * np.asarray(density, dtype=np.float64)))


def falling_through(
    distance: NDArray[np.float64], density: NDArray[np.float64], limit: float, end: float = math.inf
) -> float:
    """Farthest distance (m) at which the density falls through the limit, linear between the places given.

    Beyond the last place it falls linearly to zero at `end` (inf: at once). 0 where the limit is never reached.
    """
    above = np.flatnonzero(density >= limit)
    if above.size == 0:
        return 0.0
    last = int(above[-1])
    if last + 1 < len(distance):
        after, further = float(density[last + 1]), float(distance[last + 1])
    else:
        after, further = 0.0, end if math.isfinite(end) else float(distance[last])
    share = (density[last] - limit) / (density[last] - after)
    return float(distance[last] + share * (further - distance[last]))


def by_azimuth(
    hits: NDArray[Any], criteria: Criteria | None = None, *, sector_width: float = 5.0
) -> list[dict[str, float]]:
    """Return the table of a witness surface by sector, as in summary.json, for the hits on it.

    `mean_initial_speed` is mass-weighted, as everywhere; `mean_initial_speed_by_number` counts every hit alike. 0 in
    empty sectors.
    """
    criteria = criteria or Criteria()
    sector, sectors, centres = _sectors(hits["azimuth"], sector_width)
    number = np.bincount(sector, minlength=sectors)
    mass = np.bincount(sector, weights=hits["mass"], minlength=sectors)
    momentum = np.bincount(sector, weights=hits["mass"] * hits["initial_speed"], minlength=sectors)
    speed = np.bincount(sector, weights=hits["initial_speed"], minlength=sectors)
    hazardous = np.bincount(sector[hits["energy"] >= criteria.energy], minlength=sectors)
    fastest = np.zeros(sectors)
    np.maximum.at(fastest, sector, hits["initial_speed"])
    return [
        {
            "azimuth_deg": float(centres[i]),
            "hits": int(number[i]),
            "max_initial_speed": float(fastest[i]),
            "mean_initial_speed": float(momentum[i] / mass[i]) if number[i] else 0.0,
            "mean_initial_speed_by_number": float(speed[i] / number[i]) if number[i] else 0.0,
            "hazardous_hits": int(hazardous[i]),
            "mass": float(mass[i]),
        }
        for i in range(sectors)
    ]


def density_on(
    hits: NDArray[Any], surface: Cylinder | Panel | Polygon, criteria: Criteria | None = None
) -> tuple[float, float]:
    """Hazardous fragments per area of a finite witness surface, and per area normal to their paths (1/m2)."""
    from flight.targets import Cylinder

    criteria = criteria or Criteria()
    if not math.isfinite(surface.area):
        raise InputError(f"witness {surface.name}: it reaches over all heights; a density needs a bottom and a top")
    dangerous = hits[hits["energy"] >= criteria.energy]
    if isinstance(surface, Cylinder):
        normal = dangerous["position"][:, :2] - surface.centre
        normal /= np.linalg.norm(normal, axis=1, keepdims=True)
        across = np.einsum("ij,ij->i", dangerous["velocity"][:, :2], normal)
    else:
        across = dangerous["velocity"] @ surface.axes()[0]
    cosine = np.maximum(np.abs(across) / dangerous["speed"], math.sin(SHALLOWEST))
    return len(dangerous) / surface.area, float((1.0 / cosine).sum()) / surface.area


def _sectors(azimuth: NDArray[np.float64], width: float) -> tuple[NDArray[np.int64], int, NDArray[np.float64]]:
    count = round(360.0 / width) if width > 0.0 else 0
    if count < 1 or abs(count * width - 360.0) > 1e-9:
        raise InputError(f"hazard: sector width is {width} degrees, needed: a whole fraction of 360, such as 5")
    sector = np.floor(azimuth / width + 0.5).astype(np.int64) % count
    return sector, count, np.arange(count) * width


def _edges(distance: float | ArrayLike, farthest: float) -> NDArray[np.float64]:
    given = np.asarray(distance, dtype=np.float64)
    if given.ndim == 0:
        if not (np.isfinite(given) and given > 0.0):
            raise InputError(f"hazard: distance cells of {given} m, needed: above zero")
        return np.arange(max(1, math.ceil(farthest / float(given) + 1e-12)) + 1) * float(given)
    if (
        given.ndim != 1
        or given.size < 2
        or not np.isfinite(given).all()
        or given[0] < 0.0
        or (np.diff(given) <= 0).any()
    ):
        raise InputError("hazard: distance edges must be two or more finite numbers, rising from zero or more (m)")
    return given


def _pile(
    rows: NDArray[Any], sector: NDArray[np.int64], sectors: int, edges: NDArray[np.float64], height: float
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Landings per cell, and path lengths per cell over the height, both (sectors, cells)."""
    cells = len(edges) - 1
    place = rows["distance"]
    angle = np.maximum(np.radians(rows["angle"]), SHALLOWEST)
    cell = np.searchsorted(edges, place, side="right") - 1
    cell[place == edges[-1]] = cells - 1
    within = (cell >= 0) & (cell < cells)
    flat = sector[within] * cells + cell[within]
    numbers = np.bincount(flat, minlength=sectors * cells).reshape(sectors, cells).astype(np.float64)
    if height <= 0.0:
        weights = 1.0 / np.sin(angle[within])
        return numbers, np.bincount(flat, weights=weights, minlength=sectors * cells).reshape(sectors, cells).astype(
            float
        )
    tracks = np.zeros((sectors, cells))
    # back along the path until it rises above the height; a vertical path stays where it lands
    reach = np.minimum(height / np.tan(np.minimum(angle, math.radians(89.999))), place)
    whole = height / np.sin(angle)  # path length within the height, shortened where the path starts inside it
    full_reach = height / np.tan(np.minimum(angle, math.radians(89.999)))
    length = whole * np.where(full_reach > 0.0, reach / full_reach, 1.0)
    for j in range(cells):
        overlap = np.minimum(place, edges[j + 1]) - np.maximum(place - reach, edges[j])
        here = np.flatnonzero(overlap > 0.0)
        if here.size:
            weights = length[here] * overlap[here] / reach[here] / height
            tracks[:, j] = np.bincount(sector[here], weights=weights, minlength=sectors)
    return numbers, tracks
