"""Shapes of the map: lines of terrain lie on the ground, and every kind reaches the geographic files."""

from __future__ import annotations

import json
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from flight.hazard.contours import write_geojson, write_kml
from fragfield.case import load_case
from fragfield.case.conversion.surroundings import ground_of, site_of
from fragfield.hazard.arrangement import image_names
from fragfield.hazard.site_map import VERDICTS, Shape, terrain_lines, to_contours
from tests.fragfield.short_run import ROOT

KML = "{http://www.opengis.net/kml/2.2}"


@pytest.fixture(scope="module")
def site():
    return load_case(ROOT / "cases" / "m107_pair_site.toml")


def test_lines_of_terrain_have_the_height_of_the_ground(site):
    ground = ground_of(site)
    lines = list(terrain_lines(ground, (np.array([-200.0, -200.0]), np.array([300.0, 200.0]))))
    assert len({line.properties["height_m"] for line in lines}) >= 4
    for line in lines:
        height = ground.at(line.points[:, 0], line.points[:, 1])
        assert height == pytest.approx(np.full(len(height), line.properties["height_m"]), abs=1e-6)
        assert not line.closed


def test_places_lines_and_points_reach_geojson_and_kml(site, tmp_path):
    on_earth = site_of(site)
    shapes = [
        Shape("exposed", "yard", np.array([[10.0, 0.0], [20.0, 0.0], [20.0, 10.0]]), properties={"verdict": "met"}),
        Shape("terrain", "4 m", np.array([[0.0, 0.0], [50.0, 20.0], [90.0, 10.0]]), closed=False),
        Shape("round", "shell", np.array([[0.1, 0.0]])),
        Shape("hazard", "left to the flight", np.array([[0.0, 1.0], [1.0, 0.0], [1.0, 1.0]])),
    ]
    contours = to_contours(shapes, on_earth, site.flight.origin)
    write_geojson(contours, on_earth, tmp_path / "c.geojson")
    write_kml(contours, on_earth, tmp_path / "c.kml")
    features = json.loads((tmp_path / "c.geojson").read_text())["features"][1:]
    assert [feature["geometry"]["type"] for feature in features] == ["Point", "Polygon", "LineString"]
    ring = np.array(features[1]["geometry"]["coordinates"][0])
    assert len(ring) == 4
    assert (ring[0] == ring[-1]).all()
    back = on_earth.offsets(ring[:3, 0], ring[:3, 1])
    assert back == pytest.approx(shapes[0].points, abs=2e-4)  # nine digits of a degree
    assert features[1]["properties"]["verdict"] == "met"
    document = ET.parse(tmp_path / "c.kml").getroot().find(f"{KML}Document")
    folders = {
        folder.findtext(f"{KML}name"): folder.find(f"{KML}Placemark") for folder in document.iter(f"{KML}Folder")
    }
    kinds = {name: [child.tag.removeprefix(KML) for child in place][-1] for name, place in folders.items()}
    assert kinds == {"rounds": "Point", "exposed sites": "MultiGeometry", "contours of the ground": "LineString"}
    assert folders["exposed sites"].findtext(f"{KML}name") == "yard: met"
    assert folders["rounds"].findtext(f"{KML}name") == "shell"


def test_every_verdict_has_its_colour_in_the_files_and_differs_in_grey(site, tmp_path):
    on_earth = site_of(site)
    corners = np.array([[10.0, 0.0], [20.0, 0.0], [20.0, 10.0]])
    shapes = [Shape("exposed", name, corners, properties={"verdict": name}) for name in VERDICTS]
    write_geojson(to_contours(shapes, on_earth, (0.0, 0.0)), on_earth, tmp_path / "c.geojson")
    write_kml(to_contours(shapes, on_earth, (0.0, 0.0)), on_earth, tmp_path / "c.kml")
    features = json.loads((tmp_path / "c.geojson").read_text())["features"][1:]
    for feature in features:
        style = VERDICTS[feature["properties"]["name"]]
        assert feature["properties"]["stroke"] == feature["properties"]["fill"] == style.color
        assert feature["properties"]["fill-opacity"] == style.opacity
    assert len({style.color for style in VERDICTS.values()}) == 4
    assert len({style.marker for style in VERDICTS.values()}) == 4
    colors = [
        place.findtext(f"{KML}Style/{KML}PolyStyle/{KML}color")
        for place in ET.parse(tmp_path / "c.kml").getroot().iter(f"{KML}Placemark")
    ][1:]
    for color, style in zip(colors, VERDICTS.values(), strict=True):
        assert color[6:8] + color[4:6] + color[2:4] == style.color[1:]


def test_rounds_and_their_images_have_their_names(site):
    assert image_names(site) == ["shell", "shell, mirrored at middle"]
