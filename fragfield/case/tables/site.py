"""The table [site]: geographic position of the rounds."""

from __future__ import annotations

import math
from typing import Annotated

from fragfield.case.tables.base import Table
from fragfield_base.inputs import Quantity, degrees

__all__ = ["SiteTable"]

_HIGHEST_LATITUDE = degrees(89.0)


class SiteTable(Table):
    """Where `flight.origin` lies and how the axes are turned; with it, distances are written as maps."""

    latitude: Annotated[float, Quantity("rad", "51.5 deg", minimum=-_HIGHEST_LATITUDE, maximum=_HIGHEST_LATITUDE)]
    """North positive, on WGS 84; to 89 degrees, since near a pole a contour has no map."""
    longitude: Annotated[float, Quantity("rad", "7.25 deg", minimum=-2.0 * math.pi, maximum=2.0 * math.pi)]
    """East positive."""
    bearing: Annotated[float, Quantity("rad", "90 deg", minimum=-2.0 * math.pi, maximum=2.0 * math.pi)]
    """Of +x, clockwise from north: with 90 degrees x points east and y north."""
