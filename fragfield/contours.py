"""Distances as maps, where the case says where on Earth it stands."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Mapping

    from flight.ensemble import EnsembleHazard
    from fragfield.case import Case
    from fragfield.run_directory import RunDirectory

__all__ = ["write_contours"]


def write_contours(case: Case, found: EnsembleHazard, target: RunDirectory, provenance: Mapping[str, str]) -> None:
    """Write contours.geojson and contours.kml into the run directory, or nothing without a table [site]."""
    if case.site is None:
        return
    from flight.contours import Site, contours_of, write_geojson, write_kml

    # Free of what the way over radians adds in the last digits.
    degrees = (round(math.degrees(value), 10) for value in (case.site.latitude, case.site.longitude, case.site.bearing))
    site = Site(*degrees)
    contours = contours_of(found, site)
    write_geojson(contours, site, target.file("contours.geojson"), provenance)
    write_kml(contours, site, target.file("contours.kml"), provenance)
