"""Densities of known fields: from landings, and from expected densities given as functions."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from flight.fluence import PolarGrid
from flight.hazard.criteria import Criteria
from flight.hazard.density.density_counts import DensityGroups
from flight.hazard.density.directions import Directions
from flight.hazard.density.expected import ExpectedDistance, expected_distance
from flight.hazard.density.sectors import tally
from flight.hazard.ensemble import EnsembleHazard
from flight.hazard.pool import Completeness, FlightCounts, PooledFlights

LIMIT = 1.0 / 55.7


def landings_of(rows: np.ndarray, grid: PolarGrid) -> np.ndarray:
    """Landed fragments by cell of a grid."""
    turn, cell = grid.cells_of(rows["azimuth"], rows["distance"])
    field = np.bincount(turn * grid.shape[1] + cell, minlength=grid.shape[0] * grid.shape[1])
    return field.reshape(grid.shape).astype(float)


def groups_of_landings(realisations: Sequence[np.ndarray], directions: Directions) -> DensityGroups:
    """Groups of landed fragments, all hazardous, that fall steeply: their path lengths are their landings."""
    groups = DensityGroups(directions)
    for rows in realisations:
        field = landings_of(rows, directions.grid)
        groups.add(field, field)
    return groups


def ensemble_of_landings(
    realisations: Sequence[np.ndarray], directions: Directions, criteria: Criteria | None = None
) -> EnsembleHazard:
    """Hazard over realisations of landed fragments that fall steeply."""
    criteria = criteria or Criteria()
    pool = PooledFlights(directions, criteria, ricochet=False)
    for rows in realisations:
        field = landings_of(rows[rows["energy"] >= criteria.energy], directions.grid)
        counts = tally(rows, criteria.energy, sector_width=360.0 / directions.grid.sectors)
        pool.add(FlightCounts((field, field), (field, field), Completeness(len(rows), len(rows)), counts))
    return pool.hazard()


def distance_of_landings(realisations: Sequence[np.ndarray], **settings: Any) -> ExpectedDistance:
    """The distance over all azimuths of landed fragments."""
    directions = Directions(PolarGrid.of(72, 10.0, 10.0, 3000.0), **settings)
    return expected_distance(groups_of_landings(realisations, directions), LIMIT)


def expected_numbers(
    grid: PolarGrid, radial: Callable[[np.ndarray], np.ndarray], azimuthal: Callable[[np.ndarray], np.ndarray]
) -> np.ndarray:
    """Expected number in every cell (turns, r) of the density radial(r) azimuthal(degrees), by Gauss quadrature."""
    place, weight = np.polynomial.legendre.leggauss(8)
    place, weight = 0.5 * (place + 1.0), 0.5 * weight
    r = grid.edges[:-1, None] + np.diff(grid.edges)[:, None] * place
    along = (radial(r) * r * weight).sum(axis=1) * np.diff(grid.edges)
    azimuth = grid.start + grid.width * (np.arange(grid.azimuth_cells)[:, None] + place)
    around = (azimuthal(azimuth) * weight).sum(axis=1) * np.radians(grid.width)
    return around[:, None] * along
