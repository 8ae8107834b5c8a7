"""Sites from GeoJSON and KML: what each kind of place becomes, and what is refused in one line."""

from __future__ import annotations

import json
import math
import zipfile

import numpy as np
import pytest

from flight.scene.targets import signed_area
from fragfield.case import load_case
from fragfield.case.tables.surroundings import PlacesTable
from fragfield.checking.check import describe_exposed
from fragfield.errors import InputError
from fragfield.places.tables import box_around, convex_parts, tables_of_places

LATITUDE, LONGITUDE = 51.5, 7.0
SITE = f'[site]\nlatitude = "{LATITUDE} deg"\nlongitude = "{LONGITUDE} deg"\nbearing = "90 deg"\n'


def at(x, y):
    """Longitude and latitude of a place x m east and y m north."""
    radius = 6378137.0 / math.sqrt(1.0 - 0.00669437999 * math.sin(math.radians(LATITUDE)) ** 2)
    north = radius * (1.0 - 0.00669437999) / (1.0 - 0.00669437999 * math.sin(math.radians(LATITUDE)) ** 2)
    return [
        LONGITUDE + math.degrees(x / (radius * math.cos(math.radians(LATITUDE)))),
        LATITUDE + math.degrees(y / north),
    ]


def feature(shape, coordinates, **properties):
    return {"type": "Feature", "properties": properties, "geometry": {"type": shape, "coordinates": coordinates}}


YARD = [at(100, 0), at(160, 0), at(160, 60), at(130, 20), at(100, 60), at(100, 0)]
HALL = [at(0, 200), at(24, 232), at(0, 250), at(-24, 218), at(0, 200)]  # 40 m by 30 m, turned by 53.13 degrees
PLACES = [
    feature("Point", at(50, 0), name="clerk", kind="person", number=2),
    feature("LineString", [at(-50, 80), at(50, 80)], name="B 12", kind="roads", width_ft=20),
    feature("Polygon", [YARD, [at(101, 1), at(102, 1), at(102, 2), at(101, 1)]], name="yard", kind="area"),
    feature("MultiPolygon", [[HALL]], name="hall", kind="Halle", height="7.5 m"),
    feature("LineString", [at(20, -10), at(20, 0), at(20, 10)], name="bank", kind="barricade", height=3, slope="1.5"),
    {"type": "Feature", "properties": {"name": "nowhere"}, "geometry": None},
    feature("Point", at(5, 5), name="tree", kind="Baum"),
]  # fmt: skip
OPTIONS = {"kinds": {"Halle": "building", "Baum": "ignore"}, "unit": "1 m"}


def case_of(tmp_path, places, options=None, name="places.geojson", **members):
    if isinstance(places, list):
        places = json.dumps({"type": "FeatureCollection", "features": places, **members})
    (tmp_path / name).write_bytes(places if isinstance(places, bytes) else places.encode())
    keys = "".join(
        f", {key} = {json.dumps(value) if isinstance(value, str) else inline(value)}"
        for key, value in (options or {}).items()
    )
    (tmp_path / "case.toml").write_text(f'{SITE}places = {{ file = "{name}"{keys} }}\n')
    return load_case(tmp_path / "case.toml", burst=False)


def inline(table):
    return "{ " + ", ".join(f'"{key}" = "{value}"' for key, value in table.items()) + " }"


def test_every_kind_of_place_of_a_geojson(tmp_path, caplog):
    case = case_of(tmp_path, PLACES, OPTIONS)
    exposed = {one.name: one for one in case.exposed}
    yard = [name for name in exposed if name.startswith("yard")]
    assert list(exposed) == ["clerk", "B 12", *yard, "hall"]
    assert exposed["clerk"].position == pytest.approx((50.0, 0.0), abs=0.01)
    assert exposed["clerk"].number == 2.0
    assert exposed["B 12"].points == pytest.approx(np.array([(-50.0, 80.0), (50.0, 80.0)]), abs=0.01)
    assert exposed["B 12"].width == pytest.approx(6.096)
    parts = [np.array(exposed[name].points) for name in yard]
    assert sum(signed_area(part) for part in parts) == pytest.approx(60 * 60 - 30 * 40, rel=1e-3)
    hall = exposed["hall"]
    assert hall.position == pytest.approx((0.0, 225.0), abs=0.01)
    assert (hall.length, hall.width, hall.height) == pytest.approx((40.0, 30.0, 7.5), abs=0.02)
    assert math.degrees(hall.azimuth) == pytest.approx(53.13, abs=0.05)
    bank = case.obstacle
    assert [(one.name, one.height, one.slope) for one in bank] == [("bank", 3.0, 1.5), ("bank 2", 3.0, 1.5)]
    assert bank[1].end == pytest.approx((20.0, 10.0), abs=0.01)
    said = " ".join(record.getMessage() for record in caplog.records)
    for words in ("1 features without a place", "its 1 holes", "not convex, in", "1 places ignored"):
        assert words in said
    assert case.site.places is None  # the tables stand for it
    assert len([*describe_exposed(case)]) == len(exposed)


KML = f"""<?xml version="1.0" encoding="UTF-8"?>
<kml xmlns="http://www.opengis.net/kml/2.2" xmlns:gx="http://www.google.com/kml/ext/2.2"><Document>
<Folder><name>Roads</name><Folder><name>north</name><Placemark><name>lane</name>
<LineString><coordinates> {at(-9, 40)[0]},{at(-9, 40)[1]},12 {at(9, 40)[0]},{at(9, 40)[1]},12
</coordinates></LineString></Placemark></Folder></Folder>
<Placemark><name>crew</name><ExtendedData><Data name="kind"><value>people</value></Data><Data name="number"><value>4
</value></Data></ExtendedData><MultiGeometry>
<Point><altitudeMode>absolute</altitudeMode><coordinates>{at(30, 0)[0]},{at(30, 0)[1]},85</coordinates></Point>
<Point><coordinates>{at(0, 30)[0]},{at(0, 30)[1]}</coordinates></Point></MultiGeometry></Placemark>
<Placemark><name>shed</name><ExtendedData><SchemaData schemaUrl="#s"><SimpleData name="kind">building</SimpleData>
<SimpleData name="height">10 ft</SimpleData></SchemaData></ExtendedData><Polygon><outerBoundaryIs><LinearRing><coordinates>
{" ".join(f"{x},{y},0" for x, y in HALL)}</coordinates></LinearRing></outerBoundaryIs></Polygon></Placemark>
<NetworkLink><Link><href>http://elsewhere/</href></Link></NetworkLink></Document></kml>
"""  # noqa: E501


@pytest.mark.parametrize("kind", ["kml", "kmz", "old"])
def test_every_kind_of_place_of_a_kml(tmp_path, caplog, kind):
    """Nested folders as kinds, extended data of both forms, several points, heights that play no part, UTF-16."""
    data = KML.encode()
    if kind == "kmz":
        with zipfile.ZipFile(tmp_path / "made.zip", "w") as archive:
            archive.writestr("files/other.kml", "<kml/>")
            archive.writestr("doc.kml", data)
        data = (tmp_path / "made.zip").read_bytes()
    if kind == "old":
        text = KML.replace("www.opengis.net/kml/2.2", "earth.google.com/kml/2.1").replace("UTF-8", "UTF-16")
        data = text.encode("utf-16")
    case = case_of(tmp_path, data, name="places.kmz" if kind == "kmz" else "places.kml")
    assert [(one.name, one.kind) for one in case.exposed] == [
        ("lane", "road"), ("crew", "person"), ("crew 2", "person"), ("shed", "building"),
    ]  # fmt: skip
    assert case.exposed[2].position == pytest.approx((0.0, 30.0), abs=0.01)
    assert case.exposed[2].number == 4.0
    assert case.exposed[3].height == pytest.approx(3.048)
    said = " ".join(record.getMessage() for record in caplog.records)
    assert "1 NetworkLink left out" in said
    assert ("1 further .kml of the archive (beside doc.kml) left out" in said) == (kind == "kmz")


def test_a_geojson_that_names_wgs_84_is_read(tmp_path):
    crs = {"type": "name", "properties": {"name": "urn:ogc:def:crs:OGC:1.3:CRS84"}}
    case = case_of(tmp_path, [feature("Point", at(50, 0), kind="person")], crs=crs)
    assert case.exposed[0].position == pytest.approx((50.0, 0.0), abs=0.01)
    assert case.exposed[0].name == "person 1"


def test_longitudes_beyond_180_degrees_are_the_same_places(tmp_path):
    from fragfield.places.site import Site

    path = tmp_path / "a.geojson"
    made = []
    for longitude in (-179.9999, 180.0001):
        path.write_text(json.dumps(feature("Point", [longitude, 10.0], kind="person")))
        made.append(tables_of_places(PlacesTable(file="a"), path, Site(10.0, 179.9999, 90.0))[0])
    assert made[0] == made[1]
    assert made[0]["exposed"][0]["position"] == ["21.928 m", "0 m"]
    # The site is where the origin of the flight lies.
    moved, _ = tables_of_places(PlacesTable(file="a"), path, Site(10.0, 179.9999, 90.0), (100.0, -40.0))
    assert moved["exposed"][0]["position"] == ["121.928 m", "-40 m"]


def swapped(places):
    turn = lambda node: node[::-1] if isinstance(node[0], float) else [turn(one) for one in node]  # noqa: E731
    return [
        {**one, "geometry": {**one["geometry"], "coordinates": turn(one["geometry"]["coordinates"])}} for one in places
    ]


PERSON = [feature("Point", at(50, 0), name="clerk", kind="person")]


@pytest.mark.parametrize(
    ("places", "options", "message"),
    [
        (swapped(PLACES[:5]), OPTIONS, r"6.4e.03 km from the site as longitude, latitude, and lie 0.02 km .*: they, or those"),  # noqa: E501
        ([feature("Point", [7.0, 53.0], kind="person")], {}, r"feature 1: lies 167 km from the site.*up to 100 km"),
        ([feature("Point", [395000.0, 5706000.0], kind="person")], {}, "found 395000, 5.706e.06, as of a grid"),
        ([feature("Point", [7.0, 95.0], kind="person")], {}, "found the latitude 95; allowed: -90 to 90"),
        (PLACES, {"unit": "1 m"}, r'known kind by the property "kind".*: "Halle" \(1\), "Point" \(1\), "Baum"|"Halle"'),
        (PERSON, {"kind": "use"}, r'no known kind by the property "use".*"Point" \(1\).*kinds = { "Point" = "person" }'),  # noqa: E501
        (PERSON, {"kinds": {"x": "persn"}}, r'kinds."x": found "persn" \(did you mean "person"'),
        ([feature("Polygon", [HALL], kind="person")], {}, 'found a Polygon as "person"; allowed: a Point; a place that has'),  # noqa: E501
        ([feature("Polygon", [HALL], kind="building")], {}, "height: missing; needed: a property height with its unit"),
        ([feature("Polygon", [HALL], kind="building", height=6)], {}, "height: found 6, without a unit.*height_m"),
        ([feature("Polygon", [[*HALL[:1], *HALL[2:3], *HALL[1:2], *HALL[3:]]], kind="area")], {}, "crosses itself"),
        ([feature("Point", ["a", 1], kind="person")], {}, "feature 1: found no geometry that can be read .*; allowed: a Point, LineString or Polygon"),  # noqa: E501
        ([feature("Polygon", [HALL[:2]], kind="area")], {}, r"found no geometry that can be read \(A linearring requires"),  # noqa: E501
        ([feature("Circle", at(0, 9), kind="person")], {}, r"found no geometry that can be read \(Unknown geometry type: 'circle'\)"),  # noqa: E501
        ([feature("Point", at(50, 0), kind="person", number="two")], {}, 'number: found "two"; allowed: a number'),
        ([feature("Point", at(50, 0), kind="person", max_hits=-1)], {}, r"exposed\[1\].max_hits: found -1"),
        ([], {}, "found no feature with a place in it"),
        ('{"type": "Topology"}', {}, 'found the type "Topology"; allowed: a FeatureCollection'),
        ('{"type": "Point", "coordinates": [NaN, 1]}', {}, "NaN is not JSON"),
        ('{"type": "Feature"}\n{"type": "Feature"}', {}, "one feature a line is no GeoJSON"),
        ("[" * 9999, {}, "not a GeoJSON: nested too deep|not JSON"),
        ('{"type": "FeatureCollection", "features": [], "crs": null}', {}, "crs: found null; allowed: longi"),
        ('{"type": "FeatureCollection", "features": [], "crs": {"properties": {"name": "WGS84 / UTM zone 32N"}}}', {},
         "crs: found .*UTM zone 32N.*; allowed: longitude and latitude"),
        ('{"type": "FeatureCollection", "features": [], "crs": {"name": "EPSG:25832"}}', {},
         r"crs: found .*EPSG:25832.*; allowed: longitude and latitude on WGS 84 \(EPSG:4326\)"),
    ],
)  # fmt: skip
def test_a_geojson_that_is_not_clear_is_refused(tmp_path, places, options, message):
    with pytest.raises(InputError, match=message):
        case_of(tmp_path, places, options)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("</kml>", "<Folder>" * 2000 + "</Folder>" * 2000 + "</kml>", "nested too deep"),
        ("</kml>", "", "not well-formed XML"),
        ("<kml ", "<gpx ", "not well-formed XML|outermost element"),
        (f"{at(0, 30)[0]},{at(0, 30)[1]}", f"{at(0, 30)[0]}, {at(0, 30)[1]}", r'coordinates: found "7.0, 51.*"; allowed: longitude,latitude'),  # noqa: E501
        (f"{at(0, 30)[0]},{at(0, 30)[1]}", f"{at(0, 30)[1]},{at(0, 30)[0]}", "lies 6.* km from the site"),
        ("<value>people</value>", "<value>Leute</value>", r'"Leute" \(2\); allowed: person, road'),
        ("outerBoundaryIs", "innerBoundary", "a Polygon without an outerBoundaryIs"),
        ("Placemark>", "Ignored>", "no placemark with a point, a line or a polygon, only 1 NetworkLink"),
    ],
)  # fmt: skip
def test_a_kml_that_is_not_clear_is_refused(tmp_path, old, new, message):
    with pytest.raises(InputError, match=message):
        case_of(tmp_path, KML.replace(old, new), name="places.kml")


def test_a_file_that_is_no_map_and_an_archive_without_one(tmp_path):
    with pytest.raises(InputError, match=r"ends in .shp; allowed: .geojson, .json, .kml, .kmz"):
        case_of(tmp_path, b"", name="a.shp")
    with zipfile.ZipFile(tmp_path / "b.kmz", "w") as archive:
        archive.writestr("a.txt", "")
    with pytest.raises(InputError, match=r"found an archive without a .kml"):
        case_of(tmp_path, (tmp_path / "b.kmz").read_bytes(), name="b.kmz")


def test_convex_parts_cover_an_outline_and_the_box_holds_it():
    """Parts of random star-shaped outlines: their areas add up, each is convex; the box of a turned rectangle is it."""
    dice = np.random.default_rng(7)
    for _ in range(20):
        turn = np.sort(dice.uniform(0.0, 2.0 * np.pi, 15))
        outline = dice.uniform(20.0, 90.0, 15)[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
        parts = convex_parts(outline)
        assert sum(map(signed_area, parts)) == pytest.approx(signed_area(outline), rel=2e-3)
        assert 1 < len(parts) <= 9
        (centre, length, width, azimuth), more = box_around(outline)
        assert length * width == pytest.approx((1.0 + more) * signed_area(outline))
        assert length >= width
        along = np.radians(azimuth + np.array([0.0, 90.0]))
        own = (outline - centre) @ np.array([np.cos(along), np.sin(along)])
        assert 2.0 * np.abs(own).max(axis=0) == pytest.approx([length, width])
        angles = np.radians(np.arange(0.0, 90.0, 0.1))
        sides = [np.ptp(outline @ [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]], axis=0) for a in angles]
        assert length * width <= np.prod(sides, axis=1).min() + 1e-9, "no other box is smaller"
    corners = np.array([[0.0, 0.0], [40.0, 0.0], [40.0, 9.0], [0.0, 9.0]])
    rotation = np.array([[math.cos(2.0), math.sin(2.0)], [-math.sin(2.0), math.cos(2.0)]])
    (centre, length, width, azimuth), more = box_around(corners @ rotation)
    assert (length, width, math.radians(azimuth)) == pytest.approx((40.0, 9.0, 2.0))
    assert centre == pytest.approx(tuple(np.array([20.0, 4.5]) @ rotation))
    assert more == pytest.approx(0.0, abs=1e-9)
