"""Contours as other programs read them: KML against the schema of the OGC, GeoJSON against RFC 7946."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

import fastkml
import numpy as np
import pygeoif
import pytest
import xmlschema

from fragfield.hazard.contours import Contour, cut_line, write_geojson, write_kml
from fragfield.places.site import Site, longitude_of

if TYPE_CHECKING:
    from collections.abc import Iterator

SCHEMA = Path(fastkml.__file__).parent / "schema" / "ogckml22.xsd"
TURN = np.arange(0.0, 360.0, 5.0)


def area(ring: np.ndarray) -> float:
    x, y = (np.asarray(ring) - ring[0]).T
    return 0.5 * float(np.dot(x[:-1], y[1:]) - np.dot(x[1:], y[:-1]))


def star(site: Site, reach: float = 800.0) -> np.ndarray:
    """An outline that crosses a meridian near its centre many times, clockwise."""
    ring = site.coordinates(TURN, reach * (1.0 + 0.7 * np.cos(np.radians(9.0 * TURN))))
    return np.concatenate([ring, ring[:1]])[::-1]


def contours(site: Site) -> list[Contour]:
    """A star, a site with a label, a line and a point: all that a map holds."""
    x, y = star(site)[0]
    label = longitude_of(float(x)), float(y)
    return [
        Contour(star(site), {"name": "star", "nothing": None, "converged": True}),
        Contour(star(site, 300.0), {"name": "school"}, label="school: met", label_at=label, opacity=0.3),
        Contour(site.coordinates([0.0, 180.0, 20.0], [500.0, 500.0, 900.0]), {"name": "road <1>"}, closed=False),
        Contour(site.coordinates([10.0], [400.0]), {"name": "shell"}, folder="rounds"),
    ]


SITES = [Site(52.25, 7.5, 30.0), Site(10.0, 179.9985, 90.0), Site(-45.0, -179.999, 0.0), Site(70.0, 180.0, 45.0)]


@pytest.mark.parametrize("site", SITES)
@pytest.mark.parametrize("longitude", [0.0, 0.0021, -0.0033])
def test_an_outline_cut_at_180_degrees_keeps_its_area(site: Site, longitude: float) -> None:
    """Parts lie within 180 degrees, run counter-clockwise, are closed, and add up to the outline."""
    ring = star(site) + np.array([longitude, 0.0])
    parts = cut_line(ring, closed=True)
    assert sum(map(area, parts)) == pytest.approx(abs(area(ring)), rel=1e-9)
    for part in parts:
        assert (part[0] == part[-1]).all()
        assert area(part) > 0.0
        assert np.abs(part[:, 0]).max() <= 180.0
        assert np.ptp(part[:, 0]) < 1.0
    assert (len(parts) > 1) == (abs(site.longitude) > 170.0)


def test_a_line_cut_at_180_degrees_keeps_its_length() -> None:
    line = np.array([[179.0, 0.0], [181.0, 2.0], [182.0, 2.0], [179.5, 4.5], [180.0, 5.0], [179.0, 6.0]])
    parts = cut_line(line)
    assert len(parts) >= 3
    assert all(np.abs(part[:, 0]).max() <= 180.0 for part in parts)
    length = sum(float(np.hypot(*np.diff(part, axis=0).T).sum()) for part in parts)
    assert length == pytest.approx(float(np.hypot(*np.diff(line, axis=0).T).sum()))
    assert cut_line(np.array([[190.0, 3.0]]))[0].tolist() == [[-170.0, 3.0]]


def positions(node: list) -> Iterator[list[float]]:
    if isinstance(node[0], float):
        yield node
    else:
        for one in node:
            yield from positions(one)


@pytest.mark.parametrize("site", SITES)
def test_geojson_is_valid_against_the_rfc_and_read_by_pygeoif(site: Site, tmp_path: Path) -> None:
    path = write_geojson(contours(site), site, tmp_path / "contours.geojson", {"version": "1"})
    read = json.loads(path.read_text(encoding="utf-8"))
    assert "crs" not in read  # RFC 7946, 4
    assert [one["properties"]["name"] for one in read["features"][1:]] == ["star", "school", "road <1>", "shell"]
    for feature in read["features"]:
        assert set(feature) == {"type", "geometry", "properties"}
        for longitude, latitude in positions(feature["geometry"]["coordinates"]):
            assert -180.0 <= longitude <= 180.0
            assert abs(latitude) <= 90.0
        shape = pygeoif.shape(feature["geometry"])
        west, south, east, north = shape.bounds
        assert west <= east
        assert south <= north
        for polygon in getattr(shape, "geoms", [shape]):
            if isinstance(polygon, pygeoif.Polygon):
                assert polygon.exterior.is_ccw  # 3.1.6
                ring = list(polygon.exterior.coords)
                assert ring[0] == ring[-1]
                assert len(ring) >= 4


@pytest.mark.parametrize("site", SITES)
def test_kml_is_valid_against_the_schema_and_read_by_fastkml(site: Site, tmp_path: Path) -> None:
    """The schema's angles are -180 to 180 degrees; every placemark is where it was."""
    path = write_kml(contours(site), site, tmp_path / "contours.kml", {"version": "1"})
    faults = [fault.reason for fault in xmlschema.XMLSchema(str(SCHEMA)).iter_errors(str(path))]
    assert faults == []
    document = fastkml.KML.from_string(path.read_text(encoding="utf-8").partition("?>")[2]).features[0]
    places = [one for folder in document.features if isinstance(folder, fastkml.Folder) for one in folder.features]
    assert [one.name for one in places] == ["star", "school: met", "road <1>", "shell"]
    for place, contour in zip(places, contours(site), strict=True):
        shapes = list(getattr(place.geometry, "geoms", [place.geometry]))
        rings = [np.array(one.exterior.coords) for one in shapes if isinstance(one, pygeoif.Polygon)]
        if rings:
            assert sum(area(ring[:, :2]) for ring in rings) == pytest.approx(abs(area(contour.ring)), rel=1e-4)
