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

from flight.arguments import require_number
from flight.errors import InputError
from fragfield_base.writing import write_text

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping, Sequence

    from numpy.typing import ArrayLike, NDArray

    from flight.hazard.ensemble import EnsembleHazard

__all__ = ["Contour", "Site", "contours_of", "write_geojson", "write_kml"]

ARC_STEP = 1.0  # degrees between two points of an arc, at most
_KML = "http://www.opengis.net/kml/2.2"
_STROKES = {
    "expected_density": "#b3361e", "recommended": "#7a1f10", "max_throw": "#16365c", "exposed": "#0b6e4f",
    "obstacle": "#6b4e16", "round": "#1d2733", "terrain": "#9a8a6f",
}  # fmt: skip
_STATISTICS = {
    "upper": "expected density, upper bound (95 %) by direction",
    "expected": "expected density by direction",
}
_LARGEST = "largest of all realisations"


@dataclass(frozen=True)
class Site:
    """Where the origin of distances lies on Earth (WGS 84).

    Attributes
    ----------
    latitude, longitude : float
        Of the origin (degrees, north and east positive).
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
        for name in ("latitude", "longitude", "bearing"):
            require_number("site", name, getattr(self, name), "degrees")
            if not math.isfinite(getattr(self, name)):
                raise InputError(f"site: {name} is {getattr(self, name)}, needed: a finite number of degrees")
        if abs(self.latitude) > 89.0:
            raise InputError(f"site: latitude is {self.latitude} degrees, allowed: -89 to 89")

    def coordinates(self, azimuth: ArrayLike, distance: ArrayLike) -> NDArray[np.float64]:
        """Longitudes and latitudes (k, 2) in degrees at azimuths (degrees from +x counter-clockwise) and distances (m).

        Raises
        ------
        InputError
            geographiclib is not installed.
        """
        geodesic = _geodesic("contours on a map")
        mask = geodesic.LATITUDE | geodesic.LONGITUDE | geodesic.LONG_UNROLL
        east = (self.longitude + 180.0) % 360.0 - 180.0
        pairs = np.broadcast_arrays(np.asarray(azimuth, dtype=np.float64), np.asarray(distance, dtype=np.float64))
        ends = (
            geodesic.WGS84.Direct(self.latitude, east, self.bearing - float(turn), float(length), mask)
            for turn, length in zip(*(values.ravel() for values in pairs), strict=True)
        )
        return np.array([(end["lon2"], end["lat2"]) for end in ends], dtype=np.float64).reshape(-1, 2)

    def offsets(self, longitude: ArrayLike, latitude: ArrayLike) -> NDArray[np.float64]:
        """Where places (degrees) lie: x and y (k, 2) in m from the origin, at their geodesic distance and azimuth.

        Raises
        ------
        InputError
            geographiclib is not installed.
        """
        geodesic = _geodesic("positions on a map")
        pairs = zip(np.atleast_1d(longitude).tolist(), np.atleast_1d(latitude).tolist(), strict=True)
        found = [geodesic.WGS84.Inverse(self.latitude, self.longitude, lat, lon) for lon, lat in pairs]
        turn = np.radians([self.bearing - way["azi1"] for way in found])
        distance = np.array([way["s12"] for way in found])
        return np.column_stack([distance * np.cos(turn), distance * np.sin(turn)])


def _geodesic(what: str) -> Any:  # noqa: ANN401 - a class of a library without types
    """GeographicLib's geodesics; raises InputError where it is not installed."""
    try:
        from geographiclib.geodesic import Geodesic  # type: ignore[import-untyped,import-not-found,unused-ignore]
    except ImportError:
        raise InputError(f"{what} need geographiclib: pip install geographiclib") from None
    return Geodesic


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
    _child(document, "name", "Fragment hazard")
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
