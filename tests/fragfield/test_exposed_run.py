"""A flight among exposed sites: summary.json, the report, the map page and the files for geographic programs."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from html import unescape
from xml.etree import ElementTree as ET

import numpy as np
import pytest

from fragfield.case import load_case
from fragfield.case.conversion.surroundings import ground_of, site_of
from fragfield.hazard import site_map
from fragfield.hazard.contents import image_names
from fragfield.hazard.contours import write_geojson, write_kml
from fragfield.hazard.site_map import VERDICTS, Shape, terrain_lines, to_contours
from fragfield.report.assemble import css_text
from tests.flight.clouds import cloud
from tests.fragfield.browser import needs_chromium, open_page, script_errors
from tests.fragfield.short_run import ROOT, invoke

CASE = """title = "Places </script> & terrain"
[document]
number = "QD-17"
revision = "C"
classification = "OPEN"
prepared_by = "A. Bee"
changes = ["Bank moved."]
[site]
latitude = "51.5 deg"
longitude = "7 deg"
bearing = "90 deg"
[[obstacle]]
name = "bank"
kind = "barricade"
start = ["-30 m", "12 m"]
end = ["30 m", "12 m"]
height = "5 m"
slope = 0.5
[[obstacle]]
name = "store"
kind = "building"
position = ["-50 m", "0 m"]
length = "12 m"
width = "8 m"
height = "5 m"
[[exposed]]
name = "open"
position = ["50 m", "0 m"]
[[exposed]]
name = "sheltered"
position = ["0 m", "25 m"]
max_probability = 0.5
[[exposed]]
name = "store"
kind = "building"
obstacle = "store"
max_hits = 1.0
wall = { material = "concrete", thickness = "30 cm" }
[[exposed]]
name = "road"
kind = "road"
points = [["-100 m", "-60 m"], ["100 m", "-60 m"]]
target_area = "10 m^2"
number = 2
"""


@pytest.fixture(scope="module")
def flown(tmp_path_factory):
    folder = tmp_path_factory.mktemp("exposed")
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    cloud(6000, seed=8).write(folder / "fragments.csv")
    fly = invoke(
        "fly", folder / "case.toml", "--fragments", folder / "fragments.csv", "--out", folder / "run", "--json"
    )
    assert fly.exit_code == 0, fly.stderr
    done = invoke("report", folder / "run")
    assert done.exit_code == 0, done.stderr
    return folder / "run", json.loads(fly.stdout)


def test_summary_holds_every_place(flown):
    _, summary = flown
    entries = {entry["name"]: entry for entry in summary["exposed"]}
    assert list(entries) == ["open", "sheltered", "store", "road"]
    store, obstacle = entries["store"], next(one for one in summary["obstacle"] if one["name"] == "store")
    assert abs(store["expected_hits"]["expected"] - obstacle["hazardous_hits"]) <= 1
    assert store["largest_energy"] == pytest.approx(obstacle["max_energy"], rel=1e-3)
    assert store["not_stopped"]["expected"] < store["expected_hits"]["expected"]
    assert store["verdict"] == "not met"
    assert entries["open"]["density_normal"]["expected"] > 10.0 * entries["sheltered"]["density_normal"]["expected"]
    assert entries["open"]["margin"] < 0.0
    assert (entries["open"]["azimuth_deg"] + entries["open"]["bearing_deg"]) % 360.0 == pytest.approx(90.0)
    assert entries["sheltered"]["margin"] is None
    assert entries["sheltered"]["no_margin"].startswith("judged by the probability of a hit")
    assert entries["road"]["expected_hits"]["expected"] == pytest.approx(
        2 * 10.0 * entries["road"]["density_normal"]["expected"]
    )
    for entry in entries.values():
        assert entry["probability"]["upper"] >= entry["probability"]["expected"]
        assert entry["expected_hits"]["upper"] > entry["expected_hits"]["expected"]
    assert summary["witness"] == []  # the places' own surfaces are no witnesses


def test_geographic_files_hold_what_the_map_holds(flown):
    run, _ = flown
    features = json.loads((run / "contours.geojson").read_text())["features"]
    kinds = [feature["properties"].get("quantity") for feature in features]
    assert kinds.count("exposed") == 4
    assert kinds.count("obstacle") == 2
    assert {"recommended", "expected_density"} <= set(kinds)
    open_place = next(f for f in features if f["properties"].get("name") == "open")
    assert open_place["properties"]["verdict"] == "not met"
    ring = np.array(open_place["geometry"]["coordinates"][0])
    east = (ring[:-1, 0].mean() - 7.0) * 111_320.0 * np.cos(np.radians(51.5))
    assert east == pytest.approx(50.0, abs=0.3)  # x points east
    text = (run / "contours.kml").read_text()
    names = [element.text for element in ET.fromstring(text).iter("{http://www.opengis.net/kml/2.2}name")]
    verdicts = {f["properties"]["name"]: f["properties"]["verdict"] for f in features if "verdict" in f["properties"]}
    assert {f"{name}: {verdicts[name]}" for name in ("open", "sheltered", "store", "road")} <= set(names)
    assert {"bank", "exposed sites", "recommended distance", "distances by direction", "obstacles"} <= set(names)
    assert open_place["properties"]["stroke"] == VERDICTS["not met"].color


def test_report_has_the_places_on_its_first_page_and_the_document_on_every_page(flown):
    run, _ = flown
    html = (run / "report.html").read_text(encoding="utf-8")
    first = html[html.index('id="decision"') : html.index('id="hazard"')]
    assert "<caption>Exposed sites</caption>" in first
    cells = r"<td[^>]*>48\s*m, bearing 89° \(E\)</td><td[^>]*>not met</td><td[^>]*>density, at most 1 in 55.7 m²</td>"
    assert re.search(rf'<th scope="row"[^>]*>open</th>{cells}', first), first[first.index(">open<") :][:300]
    assert "QD-17 · revision C" in html
    assert '@bottom-left { content: "OPEN · QD-17 · revision C · summary.json SHA-256 ' in html
    assert '@top-center { content: "OPEN"' in html
    assert ">A. Bee<" in first
    assert "Bank moved." in html
    assert 'id="figure-site_map"' in html
    assert "modified NDRC" in html
    assert 'href="map.html"' in html


def test_texts_of_the_document_end_no_string_of_the_style():
    assert css_text('A "B" </style> C\\') == "A \\22 B\\22  \\3c /style\\3e  C\\5c "


@needs_chromium
@pytest.mark.skipif(shutil.which("pdftotext") is None, reason="needs pdftotext")
def test_the_document_stands_on_every_printed_page(flown, tmp_path):
    run, _ = flown
    paper = tmp_path / "report.pdf"
    open_page(run / "report.html", tmp_path, "--no-pdf-header-footer", f"--print-to-pdf={paper}")
    printed = subprocess.run(["pdftotext", "-layout", str(paper), "-"], capture_output=True, text=True, check=True)
    pages = [page.strip().splitlines() for page in printed.stdout.split("\f")[:-1]]
    assert len(pages) > 5
    for number, lines in enumerate(pages, 1):
        assert lines[0].strip() == "OPEN", number
        assert "OPEN · QD-17 · revision C" in lines[-1], number


@needs_chromium
@pytest.mark.parametrize("size", ["1280,800", "500,844"])
def test_map_page_pans_and_zooms_without_a_network(flown, tmp_path, size):
    run, _ = flown
    probe = """<script>addEventListener("load", () => {
      const box = () => map.getAttribute("viewBox").split(" ").map(Number), before = box();
      document.getElementById("in").click();
      const closer = box();
      const at = (type, x) => new PointerEvent(type, {clientX: x, clientY: 300, pointerId: 7, bubbles: true});
      map.dispatchEvent(at("pointerdown", 200)); map.dispatchEvent(at("pointermove", 260));
      dispatchEvent(at("pointerup", 260));
      const moved = box();
      document.querySelectorAll("#list button")[0].click();
      document.title = JSON.stringify({before, closer, moved, about: document.getElementById("about").textContent,
        drawn: map.querySelectorAll("path").length, images: map.querySelectorAll("image").length,
        wide: document.documentElement.scrollWidth - innerWidth});
    });</script></body>"""
    page = tmp_path / "map.html"
    html = (run / "map.html").read_text(encoding="utf-8")
    assert html.count("</script>") == 2  # the title in the data ends no script
    page.write_text(html.replace("</body>", probe), encoding="utf-8")
    done = open_page(page, tmp_path, f"--window-size={size}", "--dump-dom")
    assert script_errors(done) == []
    found = json.loads(unescape(re.search(r"<title>(\{.*?)</title>", done.stdout)[1]))
    assert found["closer"][2] == pytest.approx(0.7 * found["before"][2])
    assert found["moved"][0] < found["closer"][0]
    assert found["moved"][2] == pytest.approx(found["closer"][2])
    assert "not met" in found["about"]
    assert found["drawn"] >= 8
    assert found["images"] == 0  # nothing is asked of a network unless its box is ticked
    assert found["wide"] <= 0


def test_places_of_an_undetermined_hazard_have_no_verdict(tmp_path, without_figures):
    text = CASE + '[flight]\ntime_limit = "0.2 s"\n'
    (tmp_path / "case.toml").write_text(text, encoding="utf-8")
    cloud(300, seed=8).write(tmp_path / "fragments.csv")
    fly = invoke("fly", tmp_path / "case.toml", "--fragments", tmp_path / "fragments.csv", "--out", tmp_path / "run")
    assert fly.exit_code == 3
    assert "exposed open: not determined (density, at most 1 in 55.7 m²), 48 m, bearing 89° (E)" in fly.stdout
    entries = json.loads((tmp_path / "run" / "summary.json").read_text())["exposed"]
    assert {entry["verdict"] for entry in entries} == {"not determined"}
    assert all(entry["probability"] is None and entry["margin"] is None for entry in entries)
    assert invoke("report", tmp_path / "run").exit_code == 0
    html = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
    assert re.search(r">not determined</td><td[^>]*>density, at most", html)


# --- Shapes of the map: lines of terrain lie on the ground, and every kind reaches the geographic files

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


def test_the_recommended_distance_goes_all_around_the_rounds(site):
    (circle,) = site_map._recommended(site, 100.0)
    away = circle.points - np.asarray(site.flight.origin)
    assert np.hypot(*away.T) == pytest.approx(np.full(len(away), 100.0))
    turn = np.sort(np.degrees(np.arctan2(away[:, 1], away[:, 0])))
    assert np.diff([*turn, turn[0] + 360.0]).max() < 1.001


def test_places_lines_and_points_reach_geojson_and_kml(site, tmp_path):
    on_earth = site_of(site)
    shapes = [
        Shape("exposed", "yard", np.array([[10.0, 0.0], [20.0, 0.0], [20.0, 10.0]]), properties={"verdict": "met"}),
        Shape("terrain", "4 m", np.array([[0.0, 0.0], [50.0, 20.0], [90.0, 10.0]]), closed=False),
        Shape("round", "shell", np.array([[0.1, 0.0]])),
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
