"""Hazard from what landed and passed: densities, distances and their bounds, exposed sites."""

from __future__ import annotations

from flight.fluence import PolarGrid
from flight.hazard.criteria import Criteria, hit_probability
from flight.hazard.density.density_counts import DensityGroups, density_counts
from flight.hazard.density.directions import Directions
from flight.hazard.density.expected import ExpectedDistance, expected_distance
from flight.hazard.density.sectors import Tally, by_azimuth, density_on, tally
from flight.hazard.ensemble import EnsembleHazard
from flight.hazard.exposed import Prism, count_exposed, surfaces_of
from flight.hazard.pool import FlightCounts, PooledFlights, ensemble_hazard

__all__ = [
    "Criteria",
    "DensityGroups",
    "Directions",
    "EnsembleHazard",
    "ExpectedDistance",
    "FlightCounts",
    "PolarGrid",
    "PooledFlights",
    "Prism",
    "Tally",
    "by_azimuth",
    "count_exposed",
    "density_on",
    "ensemble_hazard",
    "expected_distance",
    "density_counts",
    "hit_probability",
    "surfaces_of",
    "tally",
]
