"""Where the rounds stand on Earth: coordinates, bearings and points of the compass."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from flight.arguments import require_number

POINTS = ("N", "NNE", "NE", "ENE", "E", "ESE", "SE", "SSE", "S", "SSW", "SW", "WSW", "W", "WNW", "NW", "NNW")
"""The points of the compass, clockwise from north."""


def compass_point(bearing: float) -> str:
    """Nearest of the sixteen points of the compass to a bearing (degrees clockwise from north)."""
    return POINTS[math.floor(bearing / 22.5 + 0.5) % len(POINTS)]


def longitude_of(angle: float) -> float:
    """A longitude (degrees) above -180 and up to 180: the one rule, so that 190 is -170 wherever it is written."""
    if -180.0 < angle <= 180.0:
        return angle
    turned = math.remainder(angle, 360.0)
    return 180.0 if turned == -180.0 else turned


@dataclass(frozen=True)
class Site:
    """Where the origin of distances lies on Earth (WGS 84).

    Attributes
    ----------
    latitude, longitude : float
        Of the origin (degrees, north and east positive); the longitude is kept as `longitude_of` turns it.
    bearing : float
        Of +x, clockwise from north (degrees).

    Raises
    ------
    InputError
        A value is not finite, or the latitude is beyond 89 degrees.
    """

    latitude: float
    longitude: float
    bearing: float

    def __post_init__(self) -> None:
        """Refuse places that have no map."""
        require_number("site", "latitude", self.latitude, "degrees", low=-89.0, high=89.0)
        require_number("site", "longitude", self.longitude, "degrees", finite=True)
        require_number("site", "bearing", self.bearing, "degrees", finite=True)
        object.__setattr__(self, "longitude", longitude_of(self.longitude))

    def bearing_of(self, azimuth: ArrayLike) -> NDArray[np.float64]:
        """Bearings (degrees clockwise from north, 0 to 360) of azimuths (degrees from +x counter-clockwise)."""
        turned = (self.bearing - np.asarray(azimuth, dtype=np.float64)) % 360.0
        return np.where(turned == 360.0, 0.0, turned)  # of a negative rounding error

    def coordinates(self, azimuth: ArrayLike, distance: ArrayLike) -> NDArray[np.float64]:
        """Longitudes and latitudes (k, 2) in degrees at azimuths (degrees from +x, counter-clockwise) and distances."""
        from geographiclib.geodesic import Geodesic

        mask = Geodesic.LATITUDE | Geodesic.LONGITUDE | Geodesic.LONG_UNROLL
        pairs = np.broadcast_arrays(np.asarray(azimuth, dtype=np.float64), np.asarray(distance, dtype=np.float64))
        ends = (
            Geodesic.WGS84.Direct(self.latitude, self.longitude, self.bearing - float(turn), float(length), mask)
            for turn, length in zip(*(values.ravel() for values in pairs), strict=True)
        )
        return np.array([(end["lon2"], end["lat2"]) for end in ends], dtype=np.float64).reshape(-1, 2)

    def offsets(self, longitude: ArrayLike, latitude: ArrayLike) -> NDArray[np.float64]:
        """Where places (degrees) lie: x and y (k, 2) in m from the origin, at their geodesic distance and azimuth."""
        from geographiclib.geodesic import Geodesic

        pairs = zip(np.atleast_1d(longitude).tolist(), np.atleast_1d(latitude).tolist(), strict=True)
        found = [Geodesic.WGS84.Inverse(self.latitude, self.longitude, lat, lon) for lon, lat in pairs]
        turn = np.radians([self.bearing - way["azi1"] for way in found])
        distance = np.array([way["s12"] for way in found])
        return np.column_stack([distance * np.cos(turn), distance * np.sin(turn)])
