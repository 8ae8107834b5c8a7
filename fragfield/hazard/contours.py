"""Distances and exposed sites as map files, for cases with a geographic position."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from fragfield.case.conversion.surroundings import site_of

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from flight.hazard.ensemble import EnsembleHazard
    from fragfield.case import Case
    from fragfield.files.run_directory import RunDirectory

__all__ = ["write_contours"]


def write_contours(
    case: Case, found: EnsembleHazard, target: RunDirectory, provenance: Mapping[str, str],
    exposed: Sequence[Mapping[str, Any]], recommended: float | None,
) -> None:  # fmt: skip
    """Write contours.geojson and contours.kml into the run directory, or nothing without a table [site].

    They hold the recommended distance, distances by direction, exposed sites with their results, obstacles, rounds and
    lines of terrain.
    """
    site = site_of(case)
    if site is None:
        return
    from flight.hazard.contours import contours_of, write_geojson, write_kml
    from fragfield.hazard.site_map import shapes_of, to_contours

    shapes = shapes_of(case, found, exposed, recommended)
    contours = to_contours(shapes, site, case.flight.origin) + contours_of(found, site)
    write_geojson(contours, site, target.file("contours.geojson"), provenance)
    write_kml(contours, site, target.file("contours.kml"), provenance)
