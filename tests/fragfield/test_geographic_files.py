"""Distances on a map: contours against geodesics, and files that others read."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from flight import InputError
from flight.fluence import PolarGrid
from flight.hazard.density.directions import Directions
from flight.hazard.ensemble import EnsembleHazard
from flight.rows import LANDING, Status
from fragfield.hazard import site_map
from fragfield.hazard.contours import Contour, outline, smooth_outline, write_geojson, write_kml
from fragfield.places.site import Site, compass_point
from tests.flight.fields import distance_of_landings, ensemble_of_landings

Geodesic = pytest.importorskip("geographiclib.geodesic").Geodesic
KML = "{http://www.opengis.net/kml/2.2}"
SITE = Site(52.25, 7.5, 30.0)


@pytest.fixture(scope="module")
def found() -> EnsembleHazard:
    generator = np.random.default_rng(1)
    parts = []
    for _ in range(12):
        rows = np.zeros(20_000, dtype=LANDING)
        rows["status"], rows["energy"], rows["angle"] = Status.LANDED, 100.0, 30.0
        rows["azimuth"] = generator.uniform(0.0, 360.0, len(rows))
        rows["distance"] = generator.exponential(60.0, len(rows)) * (2.0 + np.cos(np.radians(rows["azimuth"])))
        parts.append(rows)
    return ensemble_of_landings(parts, Directions(PolarGrid.of(24, 15.0, 10.0, 3000.0), "worst_direction", 15.0))


def contours_of(found: EnsembleHazard, site: Site) -> list[Contour]:
    """The distances by direction as they go into the files: upper bound, expected, largest throw."""
    case: Any = SimpleNamespace(flight=SimpleNamespace(origin=(0.0, 0.0)))
    return site_map.to_contours(list(site_map._distances(case, found)), site, (0.0, 0.0))[::-1]


def inverse(site: Site, ring: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Geodesic distances (m) and bearings (degrees) from the site to the points of a ring."""
    found = [Geodesic.WGS84.Inverse(site.latitude, site.longitude, lat, lon) for lon, lat in ring]
    return np.array([one["s12"] for one in found]), np.array([one["azi1"] for one in found])


def area(ring: np.ndarray) -> float:
    x, y = ring.T
    return 0.5 * float(np.sum(x[:-1] * y[1:] - x[1:] * y[:-1]))


@pytest.mark.parametrize("site", [SITE, Site(-33.0, 179.9999, -120.0), Site(70.0, -180.0, 400.0), Site(0.0, 0.0, 0.0)])
def test_points_lie_at_their_distance_and_bearing(site: Site) -> None:
    azimuth, distance = np.arange(0.0, 360.0, 7.0), np.linspace(1.0, 3000.0, 52)
    length, bearing = inverse(site, site.coordinates(azimuth, distance))
    assert length == pytest.approx(distance, abs=1e-6)
    assert (np.abs((bearing + azimuth - site.bearing + 180.0) % 360.0 - 180.0) < 1e-6).all()


@pytest.mark.parametrize("site", [SITE, Site(-33.0, 179.9999, -120.0), Site(70.0, -180.0, 400.0), Site(0.0, 0.0, 0.0)])
def test_places_on_the_map_lead_back_to_where_they_came_from(site: Site) -> None:
    x, y = np.meshgrid([-900.0, 0.0, 40.0], [-1.0, 700.0, 30.0])
    azimuth, distance = np.degrees(np.arctan2(y, x)).ravel(), np.hypot(x, y).ravel()
    back = site.offsets(*site.coordinates(azimuth, distance).T)
    assert back == pytest.approx(np.column_stack([x.ravel(), y.ravel()]), abs=1e-6)


def test_longitudes_do_not_jump_at_the_date_line() -> None:
    longitude = Site(10.0, 179.9999, 90.0).coordinates(np.arange(0.0, 360.0, 5.0), 2000.0)[:, 0]
    assert np.ptp(longitude) < 0.1


def test_contours_have_the_distances_of_the_sectors(found: EnsembleHazard) -> None:
    contours = contours_of(found, SITE)
    names = [(one.properties["quantity"], one.properties["statistic"]) for one in contours]
    assert names == [("expected_density", "upper"), ("expected_density", "expected"), ("max_throw", "pooled")]
    expected = found.expected
    assert expected is not None
    curves = (expected.upper_by_direction, expected.by_direction, found.by_sector["max_throw"].pooled)
    for one, curve in zip(contours, curves, strict=True):
        length, bearing = inverse(SITE, one.ring)
        azimuth, width = (SITE.bearing - bearing) % 360.0, 360.0 / len(curve)
        sector = np.floor(azimuth / width + 0.5).astype(int) % len(curve)
        inside = np.abs((azimuth + width / 2) % width - width / 2) < 0.49 * width  # a limit belongs to either
        if one.properties["quantity"] == "max_throw":
            assert length[inside] == pytest.approx(curve[sector[inside]], abs=1e-6)
        else:
            line = np.interp(azimuth, *smooth_outline(curve, expected.kernel), period=360.0)
            assert length == pytest.approx(line, abs=1e-6)
            assert expected.kernel == 15.0
        assert one.properties["largest_m"] == pytest.approx(curve.max(), abs=1e-3)
        assert one.properties["realisations"] == 12
    assert contours[0].properties["largest_m"] == pytest.approx(expected.upper, abs=1e-3)
    assert contours[1].properties["largest_m"] == pytest.approx(expected.distance, abs=1e-3)
    assert "expected density, upper bound" in contours[0].properties["name"]
    for one in contours:
        assert (one.ring[0] == one.ring[-1]).all()
        assert area(one.ring) > 0.0, "the right-hand rule: counter-clockwise"


@pytest.mark.parametrize("width", [1, 3, 20])  # directions behind a barricade
def test_a_smooth_line_is_nowhere_nearer_than_the_distances_and_has_no_steps(width: int) -> None:
    distance = np.full(144, 90.0)
    distance[30 : 30 + width] = 20.0
    distance[100:101] = 120.0
    azimuth, line = smooth_outline(distance, 10.0)
    assert np.diff(np.append(azimuth, 360.0)) == pytest.approx(360.0 / len(azimuth)), "over all azimuths"
    own = np.interp(azimuth, np.arange(144) * 2.5, distance, period=360.0)
    assert (line >= own - 1e-9).all()
    assert line.max() == 120.0
    assert np.interp(250.0, azimuth, line) == 120.0, "the worst direction keeps its distance"
    step = np.abs(np.diff(np.append(line, line[0]))).max() / (360.0 / len(azimuth))
    assert step <= 70.0 / (5 * 2.5) + 1e-9, "from one level to the other over half the kernel's width"
    if width == 20:  # shade wider than the kernel is seen
        assert np.interp(75.0 + 2.5 * 9.5, azimuth, line) == pytest.approx(20.0)


def test_a_line_of_one_direction_or_without_a_kernel_is_as_the_distances() -> None:
    assert (smooth_outline(np.array([55.0]), 10.0)[1] == 55.0).all()
    assert set(smooth_outline(np.array([5.0, 50.0, 20.0, 1.0]), None)[1]) == {5.0, 50.0, 20.0, 1.0}


@pytest.mark.parametrize(
    ("azimuth", "bearing", "point"),
    [
        (0.0, 30.0, "NNE"),
        (30.0, 0.0, "N"),
        (-60.0, 90.0, "E"),
        (120.0, 270.0, "W"),
        (18.75, 11.25, "NNE"),
        (31.0, 359.0, "N"),
    ],
)
def test_bearings_turn_clockwise_from_north(azimuth: float, bearing: float, point: str) -> None:
    assert float(SITE.bearing_of(azimuth)) == pytest.approx(bearing)
    assert compass_point(float(SITE.bearing_of(azimuth))) == point
    ((x, y),) = SITE.coordinates(azimuth, 10.0)
    away = Geodesic.WGS84.Inverse(SITE.latitude, SITE.longitude, y, x)["azi1"] % 360.0
    assert abs((away - bearing + 180.0) % 360.0 - 180.0) < 1e-4


def test_arcs_keep_within_their_chords() -> None:
    azimuth, distance = outline(np.array([100.0, 200.0, 300.0, 400.0]))
    assert np.diff(azimuth).max() <= 1.0
    assert len(azimuth) == 4 * 91
    assert set(distance) == {100.0, 200.0, 300.0, 400.0}
    assert 1.0 - np.cos(np.radians(0.5)) < 4e-5


def test_all_azimuths_are_a_circle(found: EnsembleHazard) -> None:
    generator = np.random.default_rng(5)
    parts = []
    for _ in range(5):
        rows = np.zeros(5000, dtype=LANDING)
        rows["azimuth"], rows["distance"] = generator.uniform(0.0, 360.0, 5000), generator.exponential(90.0, 5000)
        parts.append(rows)
    expected = distance_of_landings(parts)
    circle = contours_of(replace(found, expected=expected), SITE)[0]
    assert inverse(SITE, circle.ring)[0] == pytest.approx(expected.upper, abs=1e-6)


def test_what_is_not_determined_has_no_line(found: EnsembleHazard) -> None:
    open_ = replace(found, undetermined="there are no fragments")
    assert {one.properties["quantity"] for one in contours_of(open_, SITE)} == {"max_throw"}


def test_no_hazard_has_no_contour() -> None:
    rows = np.zeros(3, dtype=LANDING)
    rows["status"], rows["distance"] = Status.LANDED, 50.0
    found = ensemble_of_landings([rows, rows], Directions(PolarGrid.of()))
    quantities = {one.properties["quantity"] for one in contours_of(found, SITE)}
    assert quantities == {"max_throw"}


def test_geojson_is_as_the_standard_has_it(found: EnsembleHazard, tmp_path: Path) -> None:
    contours = contours_of(found, SITE)
    path = write_geojson(contours, SITE, tmp_path / "contours.geojson", {"seed": "1"})
    read = json.loads(path.read_text())
    assert read["type"] == "FeatureCollection"
    assert read["provenance"] == {"seed": "1"}
    origin, *features = read["features"]
    assert origin["geometry"] == {"type": "Point", "coordinates": [7.5, 52.25]}
    for feature, contour in zip(features, contours, strict=True):
        assert feature["type"] == "Feature"
        assert feature["geometry"]["type"] == "Polygon"
        (ring,) = feature["geometry"]["coordinates"]
        assert ring[0] == ring[-1]
        length, _ = inverse(SITE, np.array(ring))
        assert length == pytest.approx(inverse(SITE, contour.ring)[0], abs=1e-3)
        assert feature["properties"]["name"] == contour.properties["name"]


def test_kml_is_read_back(found: EnsembleHazard, tmp_path: Path) -> None:
    contours = contours_of(found, SITE)
    path = write_kml(contours, SITE, tmp_path / "contours.kml", {"seed": "1", "case": "long"})
    root = ET.parse(path).getroot()
    assert root.tag == f"{KML}kml"
    (origin,) = root.findall(f"{KML}Document/{KML}Placemark")
    (folder,) = root.findall(f"{KML}Document/{KML}Folder")
    assert folder.findtext(f"{KML}name") == "distances by direction"
    places = folder.findall(f"{KML}Placemark")
    assert origin.findtext(f"{KML}Point/{KML}coordinates") == "7.500000000,52.250000000"
    for place, contour in zip(places, contours, strict=True):
        text = place.findtext(f"{KML}Polygon/{KML}outerBoundaryIs/{KML}LinearRing/{KML}coordinates") or ""
        ring = np.array([[float(value) for value in pair.split(",")] for pair in text.split()])
        assert ring == pytest.approx(contour.ring, abs=1e-8)
        data = {one.get("name"): one.findtext(f"{KML}value") for one in place.iter(f"{KML}Data")}
        assert data["realisations"] == "12"
        assert data["statistic"] == contour.properties["statistic"]
        assert place.findtext(f"{KML}Style/{KML}LineStyle/{KML}color", "").startswith("ff")


def test_a_folder_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    ring = Contour(np.zeros((4, 2)), {"quantity": "max_throw"})
    with pytest.raises(InputError, match="cannot be written"):
        write_geojson([ring], SITE, tmp_path / "none" / "contours.geojson")
