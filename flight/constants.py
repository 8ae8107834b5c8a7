"""Constants of the Earth that the flight uses."""

from __future__ import annotations

__all__ = ["EARTH_RADIUS", "STANDARD_GRAVITY"]

EARTH_RADIUS = 6_356_766.0
"""m; of the geopotential altitude, US Standard Atmosphere 1976, section 1.2.5."""
STANDARD_GRAVITY = 9.80665
"""m/s2; US Standard Atmosphere 1976, section 1.2.5."""
