"""Ground, height maps and obstacles from the case file to the report."""

from __future__ import annotations

import json
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pytest

from flight import Barricade, Building, Fragments, HeightMap, Wall
from flight.scene.ricochet import KINDS
from fragfield.case import load_case, read_resolved, to_toml
from fragfield.case.checks.estimates import map_warnings
from fragfield.case.conversion.clearance import min_clearance
from fragfield.case.conversion.rounds import meshed, placed
from fragfield.case.conversion.surroundings import site_of
from fragfield.case.problem import flight_arguments
from fragfield.checking.check import describe_surroundings
from fragfield.errors import InputError
from fragfield.pipeline.flown import above_ground
from fragfield.places.site import Site, longitude_of
from tests.fragfield.short_run import invoke

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.case import CaseTable

GROUND = """
[flight.ground]
map = "hill.asc"
site = ["1000 m", "5000 m"]
ricochet = "asphalt"
critical_angle_factor = 1.2
speed_kept_factor = 0.8
"""
OBSTACLES = """
[[obstacle]]
name = "bank"
kind = "barricade"
start = ["-10 m", "12 m"]
end = ["10 m", "12 m"]
height = "3 m"
slope = 1.5
[[obstacle]]
name = "wall"
kind = "wall"
start = ["12 m", "-4 m"]
end = ["12 m", "4 m"]
height = "8 ft"
base = "1 m"
[[obstacle]]
name = "store"
kind = "building"
position = ["60 m", "-30 m"]
length = "20 m"
width = "12 m"
height = "6 m"
azimuth = "30 deg"
ricochet = "concrete"
"""
SITE = '[site]\nlatitude = "52 deg"\nlongitude = "7 deg"\nbearing = "90 deg"\n'
FRAGMENTS = "mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n0.01,800,0,300,1\n0.02,0,600,30,1\n0.03,-500,10,80,1\n0.05,600,0,20,1\n"


def write_map(folder: Path, hole: str = "") -> None:
    y, x = np.meshgrid(np.arange(4000.0, 6001.0, 50.0), np.arange(0.0, 2001.0, 50.0), indexing="ij")
    heights = 100.0 + 0.01 * (x - 1000.0) + 4.0 * np.sin(y / 90.0) - 4.0 * np.sin(5000.0 / 90.0)
    lines = [" ".join(f"{value:.4f}" for value in row) for row in heights[::-1]]
    text = "ncols 41\nnrows 41\nxllcenter 0\nyllcenter 4000\ncellsize 50\nNODATA_value -9999\n"
    body = "\n".join(lines)
    if hole:
        first, _, rest = body.partition(" ")
        body = f"{hole} {rest}" if first else body
    (folder / "hill.asc").write_text(text + body + "\n")


@pytest.fixture
def folder(tmp_path) -> Path:
    write_map(tmp_path)
    (tmp_path / "mine.csv").write_text(FRAGMENTS)
    return tmp_path


def load(folder: Path, text: str):
    path = folder / "case.toml"
    path.write_text(text)
    return load_case(path, burst=False)


def test_what_reaches_the_flight(folder) -> None:
    case = load(folder, GROUND + OBSTACLES)
    found = flight_arguments(case)
    assert isinstance(found["ground"], HeightMap)
    assert found["ground"].corner == (-1000.0, -1000.0)
    assert found["ground"].at(0.0, 0.0) == pytest.approx(0.0, abs=1e-3)
    law = found["ricochet"]
    assert (law.critical_angle, law.speed_kept) == (pytest.approx(18.0), pytest.approx(0.52))
    assert law.departure == KINDS["asphalt"].departure
    assert found["obstacles"] == [
        Barricade((-10.0, 12.0), (10.0, 12.0), 3.0, 1.0, 1.5, ricochet="none", name="bank"),
        Wall((12.0, -4.0), (12.0, 4.0), 8.0 * 0.3048, base=1.0, ricochet="none", name="wall"),
        Building((60.0, -30.0), 20.0, 12.0, 6.0, azimuth=30.0, ricochet="concrete", name="store"),
    ]


def test_round_trip(folder) -> None:
    case = load(folder, GROUND + OBSTACLES)
    stored = folder / "stored.toml"
    stored.write_text(to_toml(case))
    assert read_resolved(stored) == case
    assert case.flight.ground.map == str(folder / "hill.asc")


@pytest.mark.parametrize("bearing", ["90 deg", "-270 deg"])
def test_a_site_whose_x_points_east_goes_with_a_map(folder, bearing: str) -> None:
    assert load(folder, GROUND + SITE.replace("90 deg", bearing)).site is not None


def test_a_turned_site_goes_with_flat_ground(folder) -> None:
    assert load(folder, SITE.replace("90 deg", "0 deg")).site is not None


def test_fragments_below_a_map_start_on_it(folder, caplog) -> None:
    ground = flight_arguments(load(folder, GROUND))["ground"]
    x, y = np.array([-300.0, 0.0, 200.0]), np.array([50.0, 0.0, -70.0])
    height, off = ground.at(x, y), np.array([-0.5, 2.0, -0.1])
    position = np.column_stack([x, y, height + off])
    placed = above_ground(Fragments(0.01, position, np.ones((3, 3))), ground)
    assert placed.position[:, 2] == pytest.approx(height + np.maximum(off, 0.0))
    assert "2 fragments (0.02 kg) were up to 0.5 m below the ground at the end of the burst" in caplog.text


def test_default_is_flat_soft_soil(folder) -> None:
    found = flight_arguments(load(folder, ""))
    assert (found["ground"], found["ricochet"], found["obstacles"]) == (0.0, KINDS["soft_soil"], [])
    assert flight_arguments(load(folder, '[flight.ground]\nricochet = "none"'))["ricochet"] is None


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (GROUND.replace("hill", "hall"), r"flight\.ground\.map: .*hall\.asc: no such file"),
        (GROUND.replace("hill.asc", "hill.png"), "an ESRI ASCII grid"),
        (GROUND.replace("1000 m", "9000 m"), r"x = y = 0 at 9000, 5000 m .* lies off the map"),
        (GROUND + 'height = "2 m"', "flight.ground.height: found 2 m together with a map"),
        (GROUND.replace("asphalt", "none"), 'flight.ground.critical_angle_factor: found with ricochet = "none"'),
        (OBSTACLES.replace('["12 m", "-4 m"]', '["12 m", "4 m"]'), r"obstacle\[2\]: \"wall\": start and end are both"),
        (OBSTACLES.replace('"12 m"]', '"0 m"]'), r"obstacle\[1\]: \"bank\": it stands on the origin"),
        (OBSTACLES.replace('"1 m"', '"-9 m"'), r"obstacle\[2\]: \"wall\": its top at .* m is not above the ground"),
        (
            GROUND + SITE.replace("90 deg", "0 deg"),
            r"ground\.map: .* the bearing of \+x is 0 degrees; allowed: 90, since",
        ),
        (
            GROUND + SITE.replace("90 deg", "89.99 deg"),
            r"ground\.map: .* the bearing of \+x is 89\.99 degrees; allowed: 90, since",
        ),
    ],
)
def test_messages(folder, text: str, message: str) -> None:
    with pytest.raises(InputError, match=message):
        load(folder, text)


def test_holes_are_refused_or_filled_by_word(folder, recwarn) -> None:
    write_map(folder, hole="-9999")
    with pytest.raises(InputError, match=r"flight\.ground\.map: .*1 of 1681 nodes have no height"):
        load(folder, GROUND)
    with pytest.warns(
        UserWarning,
        match="1 of 1681 nodes have no height .*filled from their neighbours; 1 of them, in wide holes or at",
    ):
        load(folder, GROUND + 'holes = "neighbours"')


def test_the_air_is_that_of_the_maps_height(folder) -> None:
    """Unless the case gives another; the resolved case holds the altitude, and flat ground is at sea level."""
    text = (folder / "hill.asc").read_text().split("cellsize 50", 1)
    heights = np.array(text[1].split("-9999", 1)[1].split(), dtype=float) + 2400.0
    body = " ".join(f"{value:.4f}" for value in heights)
    (folder / "hill.asc").write_text(f"{text[0]}cellsize 50\nNODATA_value -9999\n{body}\n")
    case = load(folder, GROUND)
    assert case.flight.air.altitude == pytest.approx(2500.0, abs=0.01)
    assert flight_arguments(case)["air"].density(0.0) == pytest.approx(0.95695, rel=1e-4)  # US Standard, table I
    assert read_resolved(written(folder, case)).flight.air.altitude == case.flight.air.altitude
    given = load(folder, GROUND + '[flight.air]\naltitude = "100 m"\n')
    assert given.flight.air.altitude == 100.0
    assert any("flight.air.altitude = 100 m, and by the map z = 0 is at 2500 m" in one for one in map_warnings(given))
    assert not list(map_warnings(case))
    assert load(folder, GROUND + 'datum = "2450 m"\n').flight.air.altitude == 2450.0
    assert load(folder, "").flight.air.altitude == 0.0


def written(folder: Path, case) -> Path:
    stored = folder / "stored.toml"
    stored.write_text(to_toml(case))
    return stored


def test_a_map_finds_its_place_by_the_site(folder) -> None:
    """A GeoTIFF on UTM and [site]: x and y are metres on the ground along the site's bearing, about flight.origin."""
    pytest.importorskip("rasterio")
    from tests.fragfield.maps import EARTH, north_up, slope, write
    from tests.fragfield.maps import SITE as PLACE

    write(folder / "hill.tif", slope(*north_up()).astype("f4"))
    site = f'[site]\nlatitude = "{EARTH[0]} deg"\nlongitude = "{EARTH[1] - 360.0} deg"\nbearing = "0 deg"\n'
    case = load(folder, f'{site}[flight]\norigin = ["100 m", "50 m"]\n[flight.ground]\nmap = "hill.tif"\n')
    assert case.site.longitude == pytest.approx(np.radians(EARTH[1]), rel=1e-14)
    ground = flight_arguments(case)["ground"]
    east, north = np.array([300.0, -400.0]), np.array([250.0, 600.0])  # from the site, which is the origin
    x, y = 100.0 + north, 50.0 - east  # +x points north
    off = 5_500_000.0 - PLACE[1]
    from pyproj import Proj

    e0, n0 = Proj("EPSG:32632")(EARTH[1], EARTH[0])
    expected = slope(e0 - PLACE[0] + east * 0.9996, n0 - PLACE[1] + off + north * 0.9996)
    assert ground.at(x, y) + ground.datum == pytest.approx(expected, abs=0.1)
    found = describe_surroundings(case)
    assert found.ground.crs == "WGS 84 / UTM zone 32N"
    assert found.altitude == pytest.approx(ground.datum)


@pytest.mark.parametrize("degrees", [190.0, -170.0, -530.0 + 360.0])
def test_a_longitude_is_written_one_way(folder, degrees: float) -> None:
    """190 degrees east is -170 in the case, on the first page, in GeoJSON, KML and on the map's page."""
    text = SITE.replace('"7 deg"', f'"{degrees} deg"')
    text += '[[exposed]]\nname = "road"\nkind = "road"\n'
    text += 'points_on_earth = [["52 deg", "190.001 deg"], ["52.001 deg", "-169.999 deg"]]\n'
    case = load(folder, text)
    assert case.site.longitude == load(folder, SITE.replace("7 deg", "-170 deg")).site.longitude < 0.0
    assert site_of(case).longitude == -170.0 == Site(52.0, degrees, 90.0).longitude
    assert 'longitude = "-2.96705972839036 rad"' in to_toml(case)
    assert {round(x) for x, _ in case.exposed[0].points} == {69}
    assert longitude_of(-180.0) == longitude_of(180.0) == longitude_of(540.0) == 180.0


def test_flight_of_ones_own_fragments_to_the_report(folder) -> None:
    (folder / "case.toml").write_text(GROUND + OBSTACLES)
    out = folder / "out"
    command = ["fly", str(folder / "case.toml"), "--fragments", str(folder / "mine.csv"), "--out", str(out), "--json"]
    done = invoke(*command)
    assert done.exit_code == 0, done.stderr
    summary = json.loads(done.stdout)
    bank, wall, store = summary["obstacle"]
    assert (bank["hits"], wall["hits"], store["hits"]) == (1, 1, 0)
    assert (bank["hazardous_hits"], bank["stopped"]) == (1, 1)
    assert ",right," in (out / "obstacle_hits.csv").read_text()
    assert summary["flight"]["landed"] == 2
    assert summary["flight"]["status"]["stopped"]["fragments"] == 2
    assert summary["hazard"]["ricochet"] == "asphalt"
    short = summary["hazard"]["without_ricochet"]
    assert short["expected"] <= summary["hazard"]["expected"]
    done = invoke("report", str(out))
    assert done.exit_code == 0, done.stderr
    page = (out / "report.html").read_text()
    for words in (
        "hits on bank",
        "hits on store",
        "Recommended, without ricochet",
        "hazardous 1, stopped 1",
    ):
        assert words in page


@pytest.mark.dolfinx
def test_check_shows_the_surroundings(folder) -> None:
    tube = (Path(__file__).parents[2] / "cases" / "tube.toml").read_text()
    text = tube.replace('cell_size = "6 mm"', 'cell_size = "12 mm"') + GROUND + 'beyond = "level"\n' + OBSTACLES
    (folder / "tube.toml").write_text(text)
    done = invoke("check", str(folder / "tube.toml"))
    assert done.exit_code == 0, done.stderr
    for words in (
        "hill.asc, 41 x 41 nodes 50 m by 50 m apart", "coordinate system: none in the file or beside it",
        "north: +x is the map's grid east", "heights: metres, which the file does not state", "holes: none",
        "datum of heights: not stated in the file; z = 0 at 100 m",
        "air: standard atmosphere, 14 °C and 1.213 kg/m³ on the ground, 100 m above sea level",
        "ricochet off the ground: asphalt, up to 18 degrees, where 0.52",
        "obstacle bank: barricade", "obstacle store: building", "ricochet as off concrete",
    ):  # fmt: skip
        assert words in done.stdout
    (folder / "tube.toml").write_text(
        tube.replace("[flight]", '[flight]\norigin = ["0 m", "30 m"]')
        + OBSTACLES.replace('position = ["60 m", "-30 m"]', 'position = ["8 m", "0 m"]')
    )
    done = invoke("check", str(folder / "tube.toml"))
    assert done.exit_code == 2
    assert "1 rounds start inside it" in done.stderr


# --- Rounds that stand or lie on the ground, and rounds that touch: placed so that no mesh reaches into the other

ROUND = """
[burst]
cell_size = "8 mm"
[[round]]
name = "shell"
profile = "m107"
explosive = "tnt"
casing = "steel_m107"
attitude = "{attitude}"
position = ["20 m", "0 m", "{z}"]
base = "ground"
[flight]
origin = ["20 m", "0 m"]
{ground}
{more}
"""
PLANE = '[[plane]]\nname = "yard"\nkind = "ground"\nheight = "2 m"\n'
STACK = '[stack]\narrangement = "{arrangement}"\n{count}\ngap = "0 mm"\nbase = "ground"\n'


def read(folder: Path, attitude: str, *, ground: str = "", more: str = "", z: str = "0 m") -> CaseTable:
    rows = "\n".join(" ".join(f"{0.01 * (x - 500.0):.3f}" for x in range(0, 1001, 100)) for _ in range(11))
    text = "ncols 11\nnrows 11\nxllcenter -500\nyllcenter -500\ncellsize 100\nNODATA_value -9999\n"
    (folder / "slope.asc").write_text(text + rows + "\n")
    path = folder / "case.toml"
    path.write_text(ROUND.format(attitude=attitude, ground=ground, more=more, z=z))
    return load_case(path)


def lowest(case: CaseTable) -> list[float]:
    """Smallest height (m) of every round, and of its mesh where a plane is in the burst."""
    outsides = (placed, partial(meshed, cell_size=case.burst.cell_size))[: 2 if case.plane else 1]
    return [min(outside(one).reach((0.0, 0.0, 1.0))[0] for outside in outsides) for one in case.round]


@pytest.mark.parametrize("attitude", ["upright", "lying", "30 deg"])
@pytest.mark.parametrize(
    ("ground", "more", "height"),
    [
        ("", "", 0.0),
        ('[flight.ground]\nheight = "2 m"\n', PLANE, 2.0),
        ('[flight.ground]\nmap = "slope.asc"\nbeyond = "level"\n', "", 0.2),  # 1 % of 20 m
    ],
)
def test_a_round_stands_on_the_ground(tmp_path: Path, attitude: str, ground: str, more: str, height: float) -> None:
    case = read(tmp_path, attitude, ground=ground, more=more)
    assert lowest(case) == [pytest.approx(height, abs=1e-9)]
    assert case.round[0].base is None


@pytest.mark.parametrize(
    ("arrangement", "count", "number"),
    [("row", "count = 3", 3), ("triangle", "count = 2", 3), ("pallet", "counts = [2, 1, 2]", 4)],
)
@pytest.mark.parametrize("attitude", ["upright", "lying"])
def test_rounds_of_a_stack_may_touch(tmp_path: Path, attitude: str, arrangement: str, count: str, number: int) -> None:
    case = read(
        tmp_path, attitude, more=PLANE.replace("2 m", "0 m") + STACK.format(arrangement=arrangement, count=count)
    )
    assert len(case.round) == number
    assert min(lowest(case)) == pytest.approx(0.0, abs=1e-9)
    for outside in (placed, partial(meshed, cell_size=case.burst.cell_size)):
        _, _, gap = min_clearance([outside(one) for one in case.round])
        assert -1e-6 <= gap < 1e-3


def test_a_height_beside_a_base_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"round\[1\].base: found together with z = 1 m of position"):
        read(tmp_path, "upright", z="1 m")
