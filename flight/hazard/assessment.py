"""Hazard from landings: densities, hazardous fragment distance, throw, probability of a hit.

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
limit, so a distance from a single realisation is noisy: `flight.hazard.ensemble` gives its band over many.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import real_array, require_number
from flight.errors import InputError
from flight.hazard.criteria import Criteria
from flight.hazard.density.tally import Tally, tally
from flight.hazard.density.witness_hazard import by_azimuth, density_on

if TYPE_CHECKING:
    from numpy.typing import ArrayLike, NDArray

    from flight.result import FlightResult

__all__ = [
    "Criteria",
    "Hazard",
    "Tally",
    "assess",
    "by_azimuth",
    "density_on",
    "distances_through",
    "falling_through",
    "hazard_of",
    "hit_probability",
    "tally",
]


@dataclass(frozen=True, eq=False, repr=False)
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

    def __repr__(self) -> str:
        reach = f"{self.hazardous_fragment_distance:.4g} m in the worst of {len(self.azimuth)} sectors"
        return f"<flight.Hazard: {reach}, {self.hazardous.sum():.4g} hazardous fragments>"

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
    require_number("hazard", "realisations", realisations, "")
    if realisations < 1:
        raise InputError(f"hazard: realisations is {realisations}, needed: 1 or more")
    criteria = criteria or Criteria()
    return hazard_of(tally(landing, criteria, sector_width=sector_width, distance=distance), criteria, realisations)


def hazard_of(counts: Tally, criteria: Criteria, realisations: int | None = None) -> Hazard:
    """Hazard of counts, pooled: densities and numbers are means over the realisations.

    Parameters
    ----------
    counts : Tally
        Of one realisation or many.
    criteria : Criteria
        Those that were counted with.
    realisations : int, optional
        How many the counts come from; default: as many as the tally has rows.
    """
    number = counts.realisations if realisations is None else realisations
    ground = counts.landings.sum(axis=0) / counts.area / number
    normal = counts.tracks.sum(axis=0) / counts.area / number
    # Sectors are alike in area.
    all_ground, all_normal = ground.mean(axis=0), normal.mean(axis=0)
    middle = 0.5 * (counts.edges[1:] + counts.edges[:-1])

    def distances(density: NDArray[np.float64]) -> NDArray[np.float64]:
        return distances_through(middle, density, criteria.density, float(counts.edges[-1]))

    return Hazard(
        criteria, number, counts.azimuth, counts.edges, ground, normal, all_ground, all_normal,
        hit_probability(normal, criteria.person_area), distances(ground), distances(normal),
        counts.throw.max(axis=0), counts.fragments.sum(axis=0) / number, counts.hazardous.sum(axis=0) / number,
        float(distances(all_ground)), float(distances(all_normal)),
    )  # fmt: skip


def hit_probability(density: ArrayLike, person_area: float = 0.58) -> NDArray[np.float64]:
    """Probability p = 1 - exp(-q A) of a hit on a person of area A (m2) at a trajectory-normal density q (1/m2)."""
    require_number("hazard", "person_area", person_area, "m2")
    return np.asarray(-np.expm1(-person_area * real_array("hazard", "density", density, "1/m2")))


def falling_through(
    distance: NDArray[np.float64], density: NDArray[np.float64], limit: float, end: float = math.inf
) -> float:
    """Farthest distance (m) at which the density falls through the limit, linear between the positions given.

    Beyond the last position it falls linearly to zero at `end` (inf: at once). 0 where the limit is never reached.
    """
    return float(distances_through(distance, density, limit, end))


def distances_through(
    distance: NDArray[np.float64], density: NDArray[np.float64], limit: float, end: float = math.inf
) -> NDArray[np.float64]:
    """`falling_through` of many densities (..., r) at the same positions (r,): distances of shape (...)."""
    above = density >= limit
    reached = above.any(axis=-1)
    last = distance.size - 1 - np.argmax(above[..., ::-1], axis=-1)
    further = np.append(distance, end if math.isfinite(end) else distance[-1])
    after = np.concatenate([density, np.zeros((*density.shape[:-1], 1))], axis=-1)

    def at(position: NDArray[np.int64]) -> NDArray[np.float64]:
        return np.take_along_axis(after, position[..., None], axis=-1)[..., 0]

    fall = np.where(reached, at(last) - at(last + 1), 1.0)
    share = (at(last) - limit) / fall
    return np.asarray(np.where(reached, distance[last] + share * (further[last + 1] - distance[last]), 0.0))
