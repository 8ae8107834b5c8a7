"""Quantities whose grid convergence is computed."""

from __future__ import annotations

__all__ = ["QUANTITIES"]

QUANTITIES = {
    "mean_initial_speed": ("mean speed", "m/s"),
    "max_initial_speed": ("largest speed of a cell", "m/s"),
    "speed_99": ("speed that 99 % of the casing's mass does not exceed", "m/s"),
    "outer_diameter": ("outer diameter", "m"),
    "hazardous_fragments": ("hazardous fragments that landed, per event", ""),
    "expected_distance": ("expected distance", "m"),
}
"""Names, words and units of what is followed."""
