"""Fragments by azimuth sector: landed and hazardous ones with their throws, and crossings of a witness surface."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.arguments import number_of_parts
from flight.errors import InputError
from flight.hazard.criteria import SHALLOWEST, Criteria
from flight.result import FlightResult
from flight.rows import Status

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from flight.scene.targets import Cylinder, Panel, Polygon


@dataclass(frozen=True, eq=False, repr=False)
class Tally:
    """What fell in s azimuth sectors in n realisations.

    Attributes
    ----------
    fragments, hazardous : (n, s) int64
        Landed fragments, and those that were hazardous at their first impact.
    throw : (n, s) float64
        Farthest last landing, after any ricochets (m); 0 where there is none.
    """

    fragments: NDArray[np.int64]
    hazardous: NDArray[np.int64]
    throw: NDArray[np.float64]

    def __repr__(self) -> str:
        number, sectors = self.throw.shape
        landed, hazardous = int(self.fragments.sum()), int(self.hazardous.sum())
        return f"<flight.Tally: {number} x {sectors} sectors, {landed} landed, {hazardous} hazardous>"

    @property
    def realisations(self) -> int:
        """Number of realisations."""
        return int(self.throw.shape[0])

    @property
    def azimuth(self) -> NDArray[np.float64]:
        """Centres of the sectors (s,) in degrees."""
        return np.arange(self.throw.shape[1]) * (360.0 / self.throw.shape[1])

    @classmethod
    def join(cls, parts: Sequence[Tally]) -> Tally:
        """All realisations of several tallies with the same sectors.

        Raises
        ------
        InputError
            There is none, or their sectors differ.
        """
        if not parts:
            raise InputError("hazard: no realisation to assess")
        if len({part.throw.shape[1] for part in parts}) > 1:
            raise InputError("hazard: tallies of different sectors cannot be put together")
        return cls(*(np.concatenate([getattr(part, name) for part in parts]) for name in cls.__dataclass_fields__))


def tally(landing: FlightResult | NDArray[Any], energy: float = 79.0, *, sector_width: float = 5.0) -> Tally:
    """Count the landed fragments of one realisation, hazardous ones from `energy` (J) on.

    `sector_width` (degrees) is a whole fraction of 360; the first sector is centred on azimuth 0.
    """
    rows = landing.landing if isinstance(landing, FlightResult) else landing
    landed = rows["status"] == Status.LANDED  # columns one by one: a table of a million rows has 171 MB
    azimuth, distances = rows["azimuth"][landed], rows["distance"][landed]
    sector, sectors = sectors_of(azimuth, sector_width)
    throw = np.zeros(sectors)
    moved = ((rows["ricochets"] > 0) & (rows["last_status"] == Status.LANDED))[landed]
    ends = sectors_of(np.where(moved, rows["last_azimuth"][landed], azimuth), sector_width)[0]
    np.maximum.at(throw, ends, np.where(moved, rows["last_distance"][landed], distances))
    dangerous = rows["energy"][landed] >= energy
    return Tally(
        np.bincount(sector, minlength=sectors)[None].astype(np.int64),
        np.bincount(sector[dangerous], minlength=sectors)[None].astype(np.int64),
        throw[None],
    )


def sectors_of(azimuth: NDArray[np.float64], width: float) -> tuple[NDArray[np.int64], int]:
    """Return the sector of every azimuth (degrees), and the number of sectors; the first is centred on 0.

    Raises InputError: the width (degrees) is not a whole fraction of 360.
    """
    count = number_of_parts("hazard", "sector_width", width, 360.0)
    return np.floor(azimuth / width + 0.5).astype(np.int64) % count, count


SECTOR_HITS = np.dtype(
    [
        ("hits", "i8"),
        ("hazardous_hits", "i8"),
        ("mass", "f8"),  # kg
        ("max_initial_speed", "f8"),  # m/s; 0 in empty sectors, as the means
        ("mean_initial_speed", "f8"),  # m/s, weighted by mass
        ("mean_initial_speed_by_number", "f8"),  # m/s
    ]
)


def sector_hits(hits: NDArray[Any], criteria: Criteria | None = None, *, sector_width: float = 5.0) -> NDArray[Any]:
    """Hits on one witness surface by azimuth sector: (s,) array of dtype SECTOR_HITS; by default 79 J is hazardous.

    `sector_width` (degrees) is a whole fraction of 360; the first sector is centred on azimuth 0.
    """
    criteria = criteria or Criteria()
    sector, sectors = sectors_of(hits["azimuth"], sector_width)
    table = np.zeros(sectors, dtype=SECTOR_HITS)
    number = np.bincount(sector, minlength=sectors)
    momentum = np.bincount(sector, weights=hits["mass"] * hits["initial_speed"], minlength=sectors)
    speed = np.bincount(sector, weights=hits["initial_speed"], minlength=sectors)
    table["hits"] = number
    table["hazardous_hits"] = np.bincount(sector[hits["energy"] >= criteria.energy], minlength=sectors)
    table["mass"] = np.bincount(sector, weights=hits["mass"], minlength=sectors)
    np.maximum.at(table["max_initial_speed"], sector, hits["initial_speed"])
    np.divide(momentum, table["mass"], out=table["mean_initial_speed"], where=number > 0)
    np.divide(speed, number, out=table["mean_initial_speed_by_number"], where=number > 0)
    return table


def by_azimuth(
    hits: NDArray[Any], criteria: Criteria | None = None, *, sector_width: float = 5.0
) -> list[dict[str, float]]:
    """Return the table of a witness surface by sector, as in summary.json, for the hits on it.

    `mean_initial_speed` is mass-weighted, as everywhere; `mean_initial_speed_by_number` counts every hit alike. 0 in
    empty sectors.
    """
    table = sector_hits(hits, criteria, sector_width=sector_width)
    return [
        {"azimuth_deg": index * (360.0 / len(table)), **{name: row[name].item() for name in SECTOR_HITS.names or ()}}
        for index, row in enumerate(table)
    ]


def density_on(
    hits: NDArray[Any], surface: Cylinder | Panel | Polygon, criteria: Criteria | None = None
) -> tuple[float, float]:
    """Hazardous fragments per area of a finite witness surface, and per area normal to their paths (1/m2)."""
    from flight.scene.targets import Cylinder

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
