"""Lines around distances by direction, and contours on a map as GeoJSON and KML.

The largest throw follows each azimuth sector as an arc, the expected density a smooth line, with points every degree or
closer: the chord then falls short of the arc by less than 0.004 % of the distance. In the files a contour is cut where
it crosses 180 degrees of longitude, and outlines run counter-clockwise.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib import resources
from itertools import groupby
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from flight.errors import InputError
from fragfield.places.site import Site, longitude_of
from fragfield_base.writing import write_text

ARC_STEP = 1.0  # degrees between two points of an arc, at most


@dataclass(frozen=True, eq=False)
class Contour:
    """A closed line on the map: (k, 2) longitudes and latitudes, the first point again at the end.

    Its longitudes go on beyond 180 degrees rather than jump.

    `properties` say what it is: name, quantity, statistic, realisations, largest distance (m), convergence. A line that
    is not `closed` stays open, and one point alone is a place. `folder` groups contours in a KML file. A `label` is
    shown at the point `label_at` (longitude, latitude) of a KML file. Colours are "#rrggbb", `width` is in pixels, and
    `opacity` is that of the fill.
    """

    ring: NDArray[np.float64]
    properties: dict[str, Any]
    closed: bool = True
    folder: str = "distances by direction"
    color: str = "#1d2733"
    width: float = 2.0
    opacity: float = 0.0
    label: str = ""
    label_at: tuple[float, float] | None = None

    @property
    def parts(self) -> list[NDArray[np.float64]]:
        """The line cut at 180 degrees."""
        return cut_line(self.ring, closed=self.closed)


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


def smooth_outline(
    distance: NDArray[np.float64], kernel: float | None
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Azimuths (degrees) and distances (m) of a smooth line around distances by direction (k,), as of `outline`.

    Where few directions see past a barricade, distances jump from one direction to the next, within the kernel over
    which they were estimated. The line follows the mean, over half the kernel, of the largest distance within half the
    kernel: it is nowhere nearer than the distance in its direction, and nowhere beyond the largest of all. `kernel` is
    the half-width of the azimuth kernel of the estimate (degrees); None over all azimuths.
    """
    if kernel is None or len(distance) < 3:
        return outline(distance)
    reach = int(0.5 * kernel / (360.0 / len(distance)) + 1e-9)
    shifts = range(-reach, reach + 1)
    largest = np.max([np.roll(distance, shift) for shift in shifts], axis=0)
    smooth = np.mean([np.roll(largest, shift) for shift in shifts], axis=0)
    smooth = np.clip(smooth, distance, distance.max())  # of rounding in the mean
    number = len(distance) * math.ceil(360.0 / len(distance) / ARC_STEP)
    azimuth = np.arange(number) * (360.0 / number)
    return azimuth, np.interp(azimuth, np.linspace(0.0, 360.0, len(distance) + 1), np.append(smooth, smooth[0]))


def write_geojson(
    contours: Sequence[Contour], site: Site, path: str | Path, provenance: Mapping[str, str] | None = None
) -> Path:
    """Write the contours and the origin as a GeoJSON FeatureCollection (RFC 7946), each with its colours."""
    origin = {
        "type": "Feature",
        "geometry": {"type": "Point", "coordinates": [site.longitude, site.latitude]},
        "properties": {"name": "origin of distances", "bearing_of_x_deg": site.bearing},
    }
    features = [
        {
            "type": "Feature",
            "geometry": _geometry(contour),
            "properties": {**contour.properties, **_simple_style(contour)},
        }
        for contour in contours
    ]
    collection = {"type": "FeatureCollection", "features": [origin, *features], "provenance": dict(provenance or {})}
    return write_text(Path(path), json.dumps(collection, indent=1) + "\n", InputError)


def write_kml(
    contours: Sequence[Contour], site: Site, path: str | Path, provenance: Mapping[str, str] | None = None
) -> Path:
    """Write the contours and the origin as KML 2.2, for globes, in folders; everything lies on the ground."""
    from jinja2 import Template

    text = (resources.files("fragfield.hazard") / "templates" / "contours.kml").read_text(encoding="utf-8")
    template = Template(text, autoescape=True, trim_blocks=True, lstrip_blocks=True)
    folders = [(name, list(lines)) for name, lines in groupby(contours, key=lambda one: one.folder)]
    stamp = {key: value for key, value in (provenance or {}).items() if key != "case"}
    return write_text(Path(path), template.render(folders=folders, site=site, provenance=stamp) + "\n", InputError)


def _geometry(contour: Contour) -> dict[str, Any]:
    parts = [[[round(x, 9), round(y, 9)] for x, y in part.tolist()] for part in contour.parts]
    if len(contour.ring) == 1:
        return {"type": "Point", "coordinates": parts[0][0]}
    shape = "Polygon" if contour.closed else "LineString"
    placed = [[part] for part in parts] if contour.closed else parts
    if len(placed) == 1:
        return {"type": shape, "coordinates": placed[0]}
    return {"type": f"Multi{shape}", "coordinates": placed}


def _simple_style(contour: Contour) -> dict[str, Any]:
    color = contour.color
    if len(contour.ring) == 1:
        return {"marker-color": color}
    line = {"stroke": color, "stroke-width": contour.width}
    return {**line, "fill": color, "fill-opacity": contour.opacity} if contour.closed else line


def cut_line(line: NDArray[np.float64], *, closed: bool = False) -> list[NDArray[np.float64]]:
    """Parts of a line or an outline between -180 and 180 degrees, as RFC 7946 (3.1.9) asks; a point is one part.

    `line` (k, 2) holds longitudes that do not jump, and latitudes (degrees); the first point of an outline again at the
    end. Parts of an outline are closed and counter-clockwise.
    """
    import shapely

    if len(line) == 1:
        return [np.array([[longitude_of(float(line[0, 0])), line[0, 1]]])]
    whole = shapely.geometry.polygon.orient(shapely.Polygon(line)) if closed else shapely.LineString(line)
    first, last = (math.floor((value + 180.0) / 360.0) for value in (line[:, 0].min(), line[:, 0].max()))
    parts = []
    for turn in range(first, last + 1):
        band = shapely.box(360.0 * turn - 180.0, -90.0, 360.0 * turn + 180.0, 90.0)
        for part in shapely.get_parts(whole if first == last else shapely.make_valid(whole).intersection(band)):
            if part.geom_type == whole.geom_type:  # not where it only touches
                edge = shapely.geometry.polygon.orient(part).exterior if closed else part
                parts.append(shapely.get_coordinates(edge) - (360.0 * turn, 0.0))
    return parts
