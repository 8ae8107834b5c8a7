"""Names of the distances of an assessment, and the number of realisations that a band needs."""

from __future__ import annotations

__all__ = ["DISTANCES", "FEWEST"]

DISTANCES = {
    "hazardous_fragment_distance": "hazardous fragment distance, worst sector",
    "hazardous_fragment_distance_ground": "hazardous fragment distance, worst sector, by area of ground",
    "hazardous_fragment_distance_normal": "hazardous fragment distance, worst sector, normal to the path",
    "hazardous_fragment_distance_all_round": "hazardous fragment distance, all azimuths",
    "hazardous_fragment_distance_all_round_ground": "hazardous fragment distance, all azimuths, by area of ground",
    "hazardous_fragment_distance_all_round_normal": "hazardous fragment distance, all azimuths, normal to the path",
    "max_range": "maximum throw",
}
"""Names of the distances over all sectors, as in summary.json, and their words."""
FEWEST = 10
"""Realisations below which a band of 5 to 95 % says nothing: its edges are then the extremes."""
