"""Hazard from what landed and passed: densities, distances and their bounds, contours, exposed sites."""

from __future__ import annotations

from flight.fluence import PolarGrid
from flight.hazard.contours import contours_of, write_geojson, write_kml
from flight.hazard.criteria import Criteria, hit_probability
from flight.hazard.density.density_counts import DensityGroups, density_counts
from flight.hazard.density.directions import Directions
from flight.hazard.density.distance import ExpectedDistance
from flight.hazard.density.expected import expected_distance
from flight.hazard.density.sectors import Tally, by_azimuth, density_on, tally
from flight.hazard.ensemble import EnsembleHazard
from flight.hazard.exposed import Prism, count_exposed, surfaces_of
from flight.hazard.flown import ensemble_hazard
from flight.hazard.pool import FlightCounts, PooledFlights
from flight.hazard.retardation import Retardation
from flight.hazard.site import Site, compass_point
from flight.hazard.tp12 import PolarField, beam_distance, effective_number, stack_distance

__all__ = [
    "Criteria",
    "DensityGroups",
    "Directions",
    "EnsembleHazard",
    "ExpectedDistance",
    "FlightCounts",
    "PolarField",
    "PolarGrid",
    "PooledFlights",
    "Prism",
    "Retardation",
    "Site",
    "Tally",
    "beam_distance",
    "by_azimuth",
    "compass_point",
    "contours_of",
    "count_exposed",
    "density_on",
    "effective_number",
    "ensemble_hazard",
    "expected_distance",
    "density_counts",
    "hit_probability",
    "stack_distance",
    "surfaces_of",
    "tally",
    "write_geojson",
    "write_kml",
]
