"""The flight alone: fragments from another source, or those of a run in another folder."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path

import pytest

from flight.files.hdf5 import read_table
from tests.fragfield.short_run import SHORT, environment, invoke


def test_fragments_of_ones_own_fly_without_dolfinx(tmp_path):
    own = tmp_path / "mine.csv"
    own.write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n0.01,800,0,100,1\n0.02,0,600,50,1\n")
    case = tmp_path / "flight.toml"
    case.write_text('[[witness]]\nname = "ring"\nradius = "25 ft"\n')
    code = (
        "import sys\nfor name in ('dolfinx', 'mpi4py', 'petsc4py'): sys.modules[name] = None\n"
        f"sys.argv = ['fragfield', 'fly', {str(case)!r}, '--fragments', {str(own)!r}, '--json', "
        f"'--out', {str(tmp_path / 'out')!r}]\n"
        "from fragfield.cli import main\nmain()"
    )
    done = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, env=environment(), timeout=120, check=False
    )
    assert done.returncode == 0, done.stderr
    summary = json.loads(done.stdout)
    assert summary["flight"]["landed"] == 2
    assert [row["azimuth_deg"] for row in summary["witness"][0]["by_azimuth"] if row["hits"]] == [0.0, 90.0]
    assert (tmp_path / "out" / "fragments.h5").is_file()


@pytest.mark.dolfinx
def test_fragments_from_elsewhere_do_not_replace_those_of_a_run(run_copy, short_case, tmp_path):
    own = tmp_path / "mine.csv"
    own.write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n0.01,800,0,100,1\n")
    done = invoke("fly", short_case, "--fragments", own, "--out", run_copy)
    assert done.exit_code == 2
    assert "holds fragments of its own break-up" in done.stderr
    assert (run_copy / "landing.h5").is_file()


def test_fragments_driven_below_the_ground_start_on_it(tmp_path):
    own = tmp_path / "mine.csv"
    own.write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n0.01,800,0,100,1\n0.02,0,600,-50,-0.1\n")
    case = tmp_path / "flight.toml"
    case.write_text("seed = 3\n")
    done = invoke("fly", case, "--fragments", own, "--out", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.stderr
    assert "1 fragments (0.02 kg) were up to 0.1 m below the ground at the end of the burst" in done.stderr
    assert json.loads(done.stdout)["flight"]["landed"] == 2


@pytest.mark.dolfinx
def test_contours_are_written_where_the_site_is_known(whole_run, short_case, tmp_path):
    case = tmp_path / "site.toml"
    case.write_text(SHORT + '\n[site]\nlatitude = "52 deg"\nlongitude = "7.5 deg"\nbearing = "90 deg"\n')
    done = invoke("fly", case, "--fragments", whole_run[0] / "fragments.h5", "--out", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.stderr
    collection = json.loads((tmp_path / "out" / "contours.geojson").read_text())
    assert collection["features"][0]["geometry"]["coordinates"] == [7.5, 52.0]
    assert "numpy" in json.loads(collection["provenance"]["versions"])
    assert (tmp_path / "out" / "contours.kml").is_file()
    assert "there is one set of fragments from another source" in done.stderr


def _fly(folder, rows, case, name="out"):
    own = folder / "mine.csv"
    own.write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n" + "".join(f"{row}\n" for row in rows))
    file = folder / f"{name}.toml"
    file.write_text(case)
    return invoke("fly", file, "--fragments", own, "--out", folder / name, "--json"), folder / name


SITE = '\n[site]\nlatitude = "52 deg"\nlongitude = "7.5 deg"\nbearing = "90 deg"\n'


ARENA = """
[flight]
gravity = "0 m/s^2"
[[witness]]
name = "ring"
radius = "3 m"
[[obstacle]]
name = "arena"
kind = "wall"
start = ["5 m", "-9 m"]
end = ["5 m", "9 m"]
height = "9 m"
"""


@pytest.mark.filterwarnings("ignore::flight.FlightWarning", "ignore:overflow:RuntimeWarning")
@pytest.mark.parametrize(
    ("case", "rows", "words"),
    [
        ('[flight]\ntime_limit = "0.2 s"\n', ["0.05,900,0,100,1"], "was stopped (1 ran out of time)"),
        (
            ARENA,
            ["0.05,900,0,0,1"],
            "none of 1 fragments landed, obstacles stopped 1, 1 crossings of witness surfaces",
        ),
    ],
)
def test_a_distance_that_is_not_determined_ends_with_exit_code_3_after_all_output(
    case, rows, words, tmp_path, without_figures
):
    done, out = _fly(tmp_path, rows, case + SITE)
    assert done.exit_code == 3, done.stderr
    assert f"the distance is not determined: {words}" in done.stderr or words in done.stderr
    summary = json.loads(done.stdout)
    stored = json.loads((out / "summary.json").read_text())
    assert stored["hazard"] == summary["hazard"]
    assert (summary["hazard"]["determined"], summary["hazard"]["expected"], summary["hazard"]["recommended"]) == (
        False, None, None,
    )  # fmt: skip
    assert words in summary["hazard"]["reason"]
    for name in ("landing.h5", "ensemble.h5", "hazard_by_sector.csv", "contours.kml"):
        assert (out / name).is_file(), name
    features = json.loads((out / "contours.geojson").read_text())["features"]
    assert not any(one["properties"].get("quantity") in ("expected_density", "recommended") for one in features)
    reported = invoke("info", out).stdout
    assert "recommended distance: not determined" in reported
    report = invoke("report", out)
    assert report.exit_code == 0, report.stderr
    assert "not determined" in (out / "report.html").read_text()


@pytest.mark.parametrize("row", ["0.05,1e200,0,0,1", "0.05,900,0,0,1e9", "1e-20,900,0,0,1"])
def test_fragments_that_cannot_be_are_refused(row, tmp_path):
    done, _ = _fly(tmp_path, ["0.05,300,0,100,1", row], "")
    assert done.exit_code == 2
    assert "mine.csv: fragments: " in done.stderr
    assert "of fragment 1 is " in done.stderr


def test_the_direction_of_fragments_from_elsewhere_is_the_worst(tmp_path):
    rows = [f"0.05,{800 + k},{10 * k - 50},{k},1" for k in range(10)]
    done, out = _fly(tmp_path, rows, "")
    assert done.exit_code == 0, done.stderr
    hazard = json.loads(done.stdout)["hazard"]
    assert hazard["basis"] == "worst_direction"
    assert hazard["direction_deg"] in (357.5, 0.0, 2.5)
    assert (hazard["realisations"], hazard["upper"], hazard["kernel_deg"]) == (1, None, 10.0)
    assert "one set of fragments from another source" in done.stderr
    printed = invoke("info", out).stdout
    assert "a single realisation has no bound" in printed


# --- Contact between fragments and their presented areas from the case file to the files and the report

CASE = """
[flight.shape]
model = "box"
[flight.collisions]
restitution = 0.5
"""
HEAD_ON = "mass_kg,x_m,z_m,vx_m_s,vy_m_s,vz_m_s,round\n0.01,-1,2,500,0,0,0\n0.01,1,2,-500,0,0,1\n0.02,0,9,0,300,300,1\n"


def fly(folder: Path, case: str) -> dict[str, object]:
    (folder / "case.toml").write_text(case)
    (folder / "mine.csv").write_text(HEAD_ON)
    command = ["fly", folder / "case.toml", "--fragments", folder / "mine.csv", "--out", folder / "out"]
    done = invoke(*[*map(str, command), "--json"])
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)["flight"]


def test_impacts_in_summary_files_and_report(tmp_path) -> None:
    summary = fly(tmp_path, CASE)
    contacts = read_table(tmp_path / "out" / "contacts.h5", "contacts")[0]
    assert (tmp_path / "out" / "contacts.csv").is_file()
    assert len(contacts) == summary["contact"]["contacts"] == 1
    speed = contacts["closing_speed"][0]
    assert 950.0 < speed < 1000.0  # drag over a metre each
    # reduced mass 5 g, restitution 0.5
    assert summary["contact"]["energy_lost"] == pytest.approx(0.5 * 0.005 * speed**2 * 0.75, rel=1e-6)
    low, high = (summary["presented_area"][f"shape_factor_{share}_percent"] for share in (5, 95))
    assert low == pytest.approx(high, rel=1e-12)  # boxes of one shape that tumble
    assert summary["presented_area"]["model"] == "box"


def test_without_contact_nothing_of_it_is_left(tmp_path) -> None:
    fly(tmp_path, CASE)
    summary = fly(tmp_path, '[flight]\ncollisions = "none"\n')
    assert "contact" not in summary
    assert not list((tmp_path / "out").glob("contacts.*"))
    assert summary["presented_area"]["model"] == "as given"
    assert summary["presented_area"]["shape_factor_95_percent"] == pytest.approx(2600.0)
