"""Contours on a map, as GeoJSON and KML: where the expected density meets the criterion, and the largest throw.

A contour follows each azimuth sector's distance as an arc of a geodesic circle about the origin on WGS 84 (geodesics
by GeographicLib, Karney 2013), with points every degree or closer: the chord then falls short of the arc by less than
0.004 % of the distance. Longitudes go on beyond 180 degrees rather than jump.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import numpy as np

from flight.errors import InputError
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import NDArray

    from flight.hazard.ensemble import EnsembleHazard
    from flight.hazard.site import Site

__all__ = ["Contour", "contours_of", "outline", "write_geojson", "write_kml"]

ARC_STEP = 1.0  # degrees between two points of an arc, at most
_KML = "http://www.opengis.net/kml/2.2"
_STROKES = {
    "expected_density": "#b3361e", "recommended": "#7a1f10", "max_throw": "#16365c", "exposed": "#0b6e4f", "obstacle": "#6b4e16",
    "round": "#1d2733", "terrain": "#9a8a6f",
}  # fmt: skip
_STATISTICS = {"upper": "expected density, upper bound (95 %) by direction", "expected": "expected density by direction"}
_LARGEST = "largest of all realisations"


@dataclass(frozen=True, eq=False)
class Contour:
    """A closed line on the map: (k, 2) longitudes and latitudes, counter-clockwise, the first point again at the end.

    `properties` say what it is: name, quantity, statistic, realisations, largest distance (m), convergence. A line that
    is not `closed` stays open, and one point alone is a place.
    """

    ring: NDArray[np.float64]
    properties: dict[str, Any]
    closed: bool = True


def contours_of(found: EnsembleHazard, site: Site) -> list[Contour]:
    """Contours of an ensemble: where the expected density meets the criterion, with its bound, and the largest throw.

    Over all azimuths the former are circles. What is zero everywhere, or not determined, has no contour.
    """
    made: list[Contour] = []
    expected = found.expected
    if expected is not None and not found.undetermined:
        converged = expected.uncertainty <= found.tolerance
        for statistic, distance in (("upper", expected.upper_by_direction), ("expected", expected.by_direction)):
            if np.isfinite(distance).all():
                name = _STATISTICS[statistic]
                made += _contour(site, distance, name, "expected_density", statistic, expected.realisations, converged)
    throw = found.by_sector["max_throw"].pooled
    name = f"farthest fragment by sector, {_LARGEST}"
    return made + _contour(site, throw, name, "max_throw", "pooled", found.realisations, converged=None)


def _contour(
    site: Site, distance: NDArray[np.float64], name: str, quantity: str, statistic: str, number: int,
    converged: bool | None,
) -> list[Contour]:  # fmt: skip
    if not distance.max(initial=0.0) > 0.0:
        return []
    azimuth, reach = outline(distance)
    ring = site.coordinates(azimuth, reach)
    kept = np.concatenate([[True], (np.diff(ring, axis=0) != 0.0).any(axis=1)])
    ring = ring[kept]
    properties = {
        "name": name,
        "quantity": quantity,
        "statistic": statistic,
        "realisations": number,
        "sectors": len(distance),
        "largest_distance_m": round(float(distance.max()), 3),
    }
    if converged is not None:
        properties["converged"] = converged
    return [Contour(np.concatenate([ring, ring[:1]]), properties)]


def outline(distance: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Azimuths (degrees) and distances (m) of the points around sectors (s,), counter-clockwise and not closed."""
    width = 360.0 / len(distance)
    steps = max(1, math.ceil(width / ARC_STEP))
    within = np.linspace(-0.5 * width, 0.5 * width, steps + 1)
    if len(distance) == 1:
        within = within[:-1]
    centre = np.arange(len(distance)) * width
    azimuth = (centre[:, None] + within).ravel()
    return azimuth, np.repeat(distance, len(within))


def write_geojson(
    contours: Sequence[Contour], site: Site, path: str | Path, provenance: Mapping[str, str] | None = None
) -> Path:
    """Write the contours and the origin as a GeoJSON FeatureCollection (RFC 7946); a colour goes with each."""
    origin = {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [site.longitude, site.latitude]},
        "properties": {"name": "origin of distances", "bearing_of_x_deg": site.bearing},
    }
    features = [
        {
            "type": "Feature",
            "geometry": _geometry(contour),
            "properties": {**contour.properties, "stroke": _stroke(contour), "fill-opacity": 0.0},
        }
        for contour in contours
    ]
    collection = {"type": "FeatureCollection", "features": [origin, *features], "provenance": dict(provenance or {})}
    return _write(Path(path), json.dumps(collection, indent=1) + "\n")


def write_kml(
    contours: Sequence[Contour], site: Site, path: str | Path, provenance: Mapping[str, str] | None = None
) -> Path:
    """Write the contours and the origin as KML 2.2, for globes; everything lies on the ground."""
    ET.register_namespace("", _KML)
    root = ET.Element(f"{{{_KML}}}kml")
    document = _child(root, "Document")
    _child(document, "name", "Fragment hazard distances")
    _data(document, {key: value for key, value in (provenance or {}).items() if key != "case"})
    place = _child(document, "Placemark")
    _child(place, "name", "origin of distances")
    _child(_child(place, "Point"), "coordinates", f"{site.longitude:.9f},{site.latitude:.9f}")
    for contour in contours:
        place = _child(document, "Placemark")
        _child(place, "name", str(contour.properties["name"]))
        style = _child(place, "Style")
        line = _child(style, "LineStyle")
        red, green, blue = (_stroke(contour)[i : i + 2] for i in (1, 3, 5))
        _child(line, "color", f"ff{blue}{green}{red}")
        _child(line, "width", "2")
        _child(_child(style, "PolyStyle"), "fill", "0")
        _data(place, contour.properties)
        if len(contour.ring) == 1:
            boundary = _child(place, "Point")
        elif contour.closed:
            polygon = _child(place, "Polygon")
            _child(polygon, "tessellate", "1")
            boundary = _child(_child(polygon, "outerBoundaryIs"), "LinearRing")
        else:
            boundary = _child(place, "LineString")
            _child(boundary, "tessellate", "1")
        _child(boundary, "coordinates", " ".join(f"{x:.9f},{y:.9f}" for x, y in contour.ring))
    ET.indent(root, " ")
    return _write(Path(path), ET.tostring(root, encoding="unicode", xml_declaration=True) + "\n")


def _geometry(contour: Contour) -> dict[str, Any]:
    places = [[round(x, 9), round(y, 9)] for x, y in contour.ring.tolist()]
    if len(places) == 1:
        return {"type": "Point", "coordinates": places[0]}
    if contour.closed:
        return {"type": "Polygon", "coordinates": [places]}
    return {"type": "LineString", "coordinates": places}


def _stroke(contour: Contour) -> str:
    quantity = contour.properties["quantity"]
    return next(color for name, color in _STROKES.items() if quantity.startswith(name))


def _child(parent: ET.Element, name: str, text: str | None = None) -> ET.Element:
    child = ET.SubElement(parent, f"{{{_KML}}}{name}")
    child.text = text
    return child


def _data(parent: ET.Element, entries: Mapping[str, object]) -> None:
    extended = _child(parent, "ExtendedData")
    for key, value in _texts(entries):
        data = _child(extended, "Data")
        data.set("name", key)
        _child(data, "value", value)


def _texts(entries: Mapping[str, object]) -> Iterator[tuple[str, str]]:
    for key, value in entries.items():
        yield key, str(value).lower() if isinstance(value, bool) else str(value)


def _write(path: Path, text: str) -> Path:
    return write_text(path, text, InputError)
