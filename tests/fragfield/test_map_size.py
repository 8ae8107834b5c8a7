"""The size that a map of heights must have, and what is not determined beyond its edge."""

from __future__ import annotations

import re
from types import SimpleNamespace
from typing import TYPE_CHECKING

import numpy as np
import pytest

import flight
from fragfield import check
from fragfield.case import load_case
from fragfield.case.checks import estimates
from fragfield.case.checks.estimates import _range, farthest_throw, map_warnings
from fragfield.case.tables.round import PlaneTable
from fragfield.checking.check import check_report
from fragfield.errors import InputError
from fragfield.hazard.verdict import beyond_map_words
from tests.fragfield.short_run import invoke

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield.case import CaseTable

CASE = """
[burst]
cell_size = "12 mm"
[[round]]
name = "shell"
profile = "m107"
explosive = "tnt"
casing = "steel_m107"
attitude = "upright"
base = "ground"
[flight.ground]
map = "level.asc"
ricochet = "none"
beyond = "level"
"""
SITE = '[site]\nlatitude = "52 deg"\nlongitude = "7 deg"\nbearing = "90 deg"\n'


def read(folder: Path, half: float, more: str = "") -> CaseTable:
    """The case on a level map of this half-width (m), which reaches 100 m farther west."""
    columns, rows = round(half / 50.0) * 2 + 3, round(half / 50.0) * 2 + 1
    head = f"ncols {columns}\nnrows {rows}\nxllcenter {-half - 100.0}\nyllcenter {-half}\ncellsize 50\n"
    (folder / "level.asc").write_text(head + "\n".join([" ".join(["0"] * columns)] * rows) + "\n")
    (folder / "case.toml").write_text(more + CASE)
    return load_case(folder / "case.toml")


def test_the_farthest_throw_is_that_at_the_best_elevation(tmp_path: Path) -> None:
    case = read(tmp_path, 500.0)
    mass, speed = np.array([0.002, 0.05, 0.4]), np.array([1500.0, 1200.0, 900.0])
    farthest = _range(case, mass, speed)
    for one in range(3):
        shape = {"shape_factor": case.flight.shape_factor, "height": 0.0}
        flown = flight.range_table(mass[one], speed[one], np.arange(1.0, 80.0), **shape)["range"].max()
        assert flown * 0.98 < farthest[one] <= flown


def test_check_names_the_size_that_a_map_must_have(tmp_path: Path) -> None:
    words = [one for one in check_report(read(tmp_path, 500.0, SITE)).warnings if "flight.ground.map" in one]
    assert len(words) == 1
    assert "ends 500 m from the rounds (bearing 90° (E))" in words[0]
    found = re.search(r"about (\d+) m.* from (-\d+) to (\d+) m along x", words[0])
    throw, low, high = map(float, found.groups())
    assert 500.0 < throw <= high == -low < throw + 50.0
    large = check_report(read(tmp_path, high, SITE)).warnings
    assert not any("flight.ground.map" in one for one in large), "a map of the size that is named is large enough"


def test_a_map_that_is_too_small_is_refused_unless_the_case_says_how_it_goes_on(tmp_path: Path) -> None:
    read(tmp_path, 500.0)
    (tmp_path / "case.toml").write_text(CASE.replace('beyond = "level"', ""))
    with pytest.raises(
        InputError, match=r'flight\.ground\.map: ends 500 m from .* about \d+ m; allowed: beyond = "level"'
    ):
        load_case(tmp_path / "case.toml")
    table = tmp_path / "own.csv"
    case = tmp_path / "own.toml"
    case.write_text(CASE[CASE.index("[flight.ground]") :].replace('beyond = "level"', ""))
    table.write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s\n0.01,300,0,100\n0.02,0,200,90\n")
    assert check(case, fragments=table).warnings == []
    table.write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s\n0.01,300,0,100\n0.3,0,1200,900\n")
    with pytest.raises(InputError, match=r"flight\.ground\.map: ends 500 m from the rounds"):
        check(case, fragments=table)
    done = invoke("fly", str(case), "--fragments", str(table), "--out", str(tmp_path / "out"))
    assert done.exit_code == 2
    assert "flight.ground.map: ends 500 m from the rounds" in done.stderr
    assert not (tmp_path / "out").exists()


@pytest.mark.parametrize("rounds", [1, 3])
def test_the_farthest_throw_is_that_of_one_piece_in_a_hundred_events(monkeypatch, tmp_path: Path, rounds: int) -> None:
    """Of a wall of 20 kg and pieces of 10 g: 5 g times ln(100 x 2000)^2; one that is lighter than that flies whole."""
    case = read(tmp_path, 500.0)
    case = case.model_copy(update={"round": case.round * rounds})
    walls = [SimpleNamespace(mean=0.01, mass=20.0, speed=1000.0), SimpleNamespace(mean=0.01, mass=0.3, speed=800.0)]
    seen = []
    monkeypatch.setattr("fragfield.case.checks.estimates.expected_means", lambda *_: walls)
    monkeypatch.setattr(estimates, "_range", lambda _, mass, speed: seen.extend([mass, speed]) or 2.0 * mass)
    heaviest = {1: 0.744941, 3: 0.885073}[rounds]  # 5 g times 12.20607^2, 13.30468^2
    assert farthest_throw(case) == pytest.approx(2.0 * heaviest, rel=1e-5)
    assert seen[0] == pytest.approx([heaviest, 0.3], rel=1e-5)
    assert seen[1] == pytest.approx([1250.0, 1000.0])


@pytest.mark.parametrize(("throw", "warned"), [(499.0, False), (501.0, True)])
def test_a_map_must_reach_as_far_as_the_farthest_throw(monkeypatch, tmp_path: Path, throw: float, warned: bool) -> None:
    monkeypatch.setattr(estimates, "farthest_throw", lambda *_: throw)
    assert bool(list(map_warnings(read(tmp_path, 500.0)))) == warned


def test_a_distance_beyond_the_map_is_not_determined(tmp_path: Path) -> None:
    case = read(tmp_path, 100.0, SITE)
    azimuth = np.arange(0.0, 360.0, 90.0)

    def words(distance: list[float], upper: list[float], direction: float | None = 0.0) -> str:
        found = SimpleNamespace(by_direction=np.array(distance), upper_by_direction=np.array(upper),
                                azimuth=azimuth[: len(distance)], direction=direction)  # fmt: skip
        return beyond_map_words(case, found)

    assert words([90.0, 80.0, 150.0, 90.0], [99.0, 90.0, 190.0, 99.0]) == "", "to the west it reaches 200 m"
    assert "it would be 103 m, bearing 0° (N), and the map ends 100 m from the rounds" in words(
        [90.0, 95.0, 150.0, 90.0], [99.0, 103.0, 190.0, 99.0]
    )
    assert "would be 130 m, bearing 180° (S)" in words([90.0, 80.0, 150.0, 130.0], [np.nan] * 4)
    assert words([99.0], [np.nan], None) == ""
    assert "would be 101 m, and the map ends 100 m" in words([95.0], [101.0], None)


def test_rounds_behind_planes_of_symmetry_throw_as_far_as_those_of_the_case(tmp_path: Path) -> None:
    """One round with three images needs the map of four rounds: the heaviest piece of four is heavier than of one."""
    case = read(tmp_path, 500.0)
    table = {"kind": "symmetry", "point": ["1 m", "1 m", "0 m"]}
    normals = {"x": [1, 0, 0], "y": [0, 1, 0]}
    planes = [PlaneTable.model_validate(table | {"name": name, "normal": one}) for name, one in normals.items()]
    mirrored = case.model_copy(update={"plane": planes})
    four = case.model_copy(update={"round": [case.round[0].model_copy(update={"name": str(k)}) for k in range(4)]})
    assert farthest_throw(mirrored) == pytest.approx(farthest_throw(four), rel=1e-12)
    assert farthest_throw(mirrored) > 1.03 * farthest_throw(case)


def test_an_obstacle_that_the_casing_reaches_is_named(tmp_path: Path) -> None:
    """Its near face 10 cm from the axis of a tube is reached within 120 us, one at 2 m is not."""
    for start, named in (("0.25 m", True), ("2 m", False)):
        text = f"""[burst]
cell_size = "12 mm"
end_time = "120 us"
[[round]]
name = "tube"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"
attitude = "upright"
position = ["0 m", "0 m", "0.5 m"]
[[obstacle]]
name = "wall"
kind = "wall"
start = ["{start}", "-5 m"]
end = ["{start}", "5 m"]
height = "3 m"
thickness = "0.3 m"
"""
        (tmp_path / "case.toml").write_text(text)
        words = [one for one in check_report(load_case(tmp_path / "case.toml")).warnings if "obstacle wall" in one]
        assert bool(words) == named
        assert all("0.1 m from the axis of round[1] (tube), whose casing grows to about" in one for one in words)
