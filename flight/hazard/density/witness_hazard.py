"""Crossings of a witness surface: numbers and speeds by azimuth sector, and densities."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from flight.hazard.criteria import SHALLOWEST, Criteria
from flight.hazard.density.tally import sectors_of

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.scene.targets import Cylinder, Panel, Polygon

__all__ = ["SECTOR_HITS", "by_azimuth", "density_on", "sector_hits"]

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
    """Hits on a witness surface by azimuth sector.

    Parameters
    ----------
    hits : structured array of dtype HITS
        Crossings of one surface.
    criteria : Criteria, optional
        What counts as hazardous; default 79 J.
    sector_width : float
        Width of a sector (degrees), a whole fraction of 360; the first is centred on azimuth 0.

    Returns
    -------
    (s,) structured array of dtype SECTOR_HITS
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
