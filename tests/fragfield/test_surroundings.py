"""Ground, height maps and obstacles from the case file to the report."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from flight import Barricade, Building, Fragments, HeightMap, Wall
from flight.scene.ricochet import KINDS
from fragfield.case import load_case, read_resolved, to_toml
from fragfield.case.conversion.stages import flight_arguments
from fragfield.cli import app
from fragfield.errors import InputError
from fragfield.pipeline.ensemble import above_ground

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
centre = ["60 m", "-30 m"]
length = "20 m"
width = "12 m"
height = "6 m"
azimuth = "30 deg"
ricochet = "concrete"
"""
COLLISIONS = "[flight.collisions]\n"
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
        (GROUND.replace("1000 m", "9000 m"), r"the site \(9000.0, 5000.0\) lies off the map"),
        (GROUND + 'height = "2 m"', "flight.ground.height: found 2 m together with a map"),
        (GROUND.replace("asphalt", "none"), 'flight.ground.critical_angle_factor: found with ricochet = "none"'),
        (GROUND.replace('map = "hill.asc"', ""), "flight.ground.site: found without a map"),
        (GROUND.replace("asphalt", "tarmac"), 'flight.ground.ricochet: found "tarmac"; allowed: .*"soft_soil".*"none"'),
        (GROUND.replace("ricochet", "ricochets"), 'flight.ground.ricochets: unknown key.*"ricochet"'),
        (GROUND.replace("ricochet", "bounce"), "flight.ground.bounce: unknown key"),
        (OBSTACLES.replace('"concrete"', '"stone"'), r"obstacle\[3\].ricochet: found \"stone\""),
        (GROUND.replace("1.2", "-1.2"), "flight.ground.critical_angle_factor: found -1.2"),
        (OBSTACLES.replace('"store"', '"bank"'), r"obstacle\[3\].name: found \"bank\", the name of obstacle\[1\]"),
        (OBSTACLES.replace('kind = "wall"', 'kind = "wal"'), r"obstacle\[2\].*"),
        (OBSTACLES.replace('"6 m"', "6"), r"obstacle\[3\].height: found the bare number 6 without a unit"),
        (OBSTACLES.replace('["12 m", "-4 m"]', '["12 m", "4 m"]'), r"obstacle\[2\]: \"wall\": start and end are both"),
        (OBSTACLES.replace('"12 m"]', '"0 m"]'), r"obstacle\[1\]: \"bank\": it stands on the origin"),
        (OBSTACLES.replace('"1 m"', '"-9 m"'), r"obstacle\[2\]: \"wall\": its top at .* m is not above the ground"),
        (
            COLLISIONS.replace("[flight.collisions]", '[flight]\ncollisions = "of"'),
            'flight.collisions: found "of".*none',
        ),
        (GROUND + SITE.replace("90 deg", "0 deg"), "site.bearing: found 0 deg together with .*map; allowed: 90 deg"),
        (
            GROUND + SITE.replace("90 deg", "89.99 deg"),
            "site.bearing: found 89.99 deg together with .*; allowed: 90 deg",
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
    with pytest.warns(UserWarning, match="1 of 1681 nodes have no height .*filled from their neighbours"):
        load(folder, GROUND + 'holes = "neighbours"')


def test_flight_of_ones_own_fragments_to_the_report(folder) -> None:
    (folder / "case.toml").write_text(GROUND + OBSTACLES)
    out = folder / "out"
    command = ["fly", str(folder / "case.toml"), "--fragments", str(folder / "mine.csv"), "--out", str(out), "--json"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.stderr
    summary = json.loads(done.stdout)
    bank, wall, store = summary["obstacle"]
    assert (bank["hits"], wall["hits"], store["hits"]) == (1, 1, 0)
    faces = {face["face"]: face for face in bank["faces"]}
    assert (faces["right"]["hits"], faces["right"]["hazardous_hits"], faces["right"]["azimuth_deg"]) == (1, 1, 270.0)
    assert bank["stopped_mass"] == 0.02
    assert summary["flight"]["landed"] == 2
    assert summary["flight"]["status"]["stopped"]["fragments"] == 2
    assert summary["flight"]["last_status"]["landed"]["fragments"] == 2
    assert summary["hazard"]["ricochet"] == "asphalt"
    short = summary["hazard"]["without_ricochet"]
    assert short["expected"] <= summary["hazard"]["expected"]
    done = CliRunner().invoke(app, ["report", str(out)])
    assert done.exit_code == 0, done.stderr
    page = (out / "report.html").read_text()
    for words in (
        "Hits on barricade “bank”",
        "Hits on building “store”",
        "Recommended, without ricochet",
        "First realisation.",
    ):
        assert words in page


@pytest.mark.dolfinx
def test_check_shows_the_surroundings(folder) -> None:
    tube = (Path(__file__).parents[2] / "cases" / "tube.toml").read_text()
    (folder / "tube.toml").write_text(tube.replace('cell_size = "6 mm"', 'cell_size = "12 mm"') + GROUND + OBSTACLES)
    done = CliRunner().invoke(app, ["check", str(folder / "tube.toml")])
    assert done.exit_code == 0, done.stderr
    for words in (
        "hill.asc, 41 x 41 nodes", "ricochet off the ground: asphalt, up to 18 degrees, where 0.52",
        "obstacle bank: barricade", "obstacle store: building", "ricochet as off concrete",
    ):  # fmt: skip
        assert words in done.stdout
    (folder / "tube.toml").write_text(
        tube.replace("[flight]", '[flight]\norigin = ["0 m", "30 m"]')
        + OBSTACLES.replace('centre = ["60 m", "-30 m"]', 'centre = ["8 m", "0 m"]')
    )
    done = CliRunner().invoke(app, ["check", str(folder / "tube.toml")])
    assert done.exit_code == 2
    assert "1 rounds start inside it" in done.stderr
