"""The geographic position of a case, and directions on its site in numbers and words."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flight.hazard.site import Site
    from fragfield.case.schema import Case

__all__ = ["bearing_of", "direction_words", "site_of", "with_bearing"]


def site_of(case: Case) -> Site | None:
    """The case's site in degrees, free of what the way over radians adds in the last digits."""
    from flight.hazard.site import Site

    if case.site is None:
        return None
    return Site(*(round(math.degrees(v), 10) for v in (case.site.latitude, case.site.longitude, case.site.bearing)))


def bearing_of(case: Case, azimuth: float | None) -> float | None:
    """Bearing (degrees clockwise from north) of an azimuth (degrees from +x); None without [site] or an azimuth."""
    site = site_of(case)
    return None if site is None or azimuth is None else float(site.bearing_of(azimuth))


def with_bearing(case: Case, entry: Mapping[str, Any]) -> dict[str, Any]:
    """An entry of summary.json with its bearing after its azimuth."""
    return {**entry, "bearing_deg": bearing_of(case, entry["azimuth_deg"])}


def direction_words(azimuth: float, bearing: float | None, *, whole: bool = False) -> str:
    """A direction as every text gives it: bearing and point of the compass where the case has a site, else azimuth.

    Parameters
    ----------
    azimuth : float
        From +x, counter-clockwise (degrees).
    bearing : float or None
        From north, clockwise (degrees), by `bearing_of`.
    whole : bool
        In whole degrees, for places; else in four digits.
    """
    from flight.hazard.site import compass_point

    angle = azimuth if bearing is None else bearing
    words = f"{round(angle) % 360}°" if whole else f"{angle:.4g}°"
    return f"azimuth {words}" if bearing is None else f"bearing {words} ({compass_point(bearing)})"
