"""The flight alone: fragments from elsewhere, or those of a run at another place."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

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
def test_fragments_from_elsewhere_do_not_replace_those_of_a_run(whole_run, short_case, tmp_path):
    own = tmp_path / "mine.csv"
    own.write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n0.01,800,0,100,1\n")
    done = invoke("fly", short_case, "--fragments", own, "--out", whole_run[0])
    assert done.exit_code == 2
    assert "holds fragments of its own break-up" in done.stderr
    assert (whole_run[0] / "landing.h5").is_file()


def test_fragments_driven_below_the_ground_start_on_it(tmp_path):
    own = tmp_path / "mine.csv"
    own.write_text("mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m\n0.01,800,0,100,1\n0.02,0,600,-50,-0.1\n")
    case = tmp_path / "flight.toml"
    case.write_text("seed = 3\n")
    done = invoke("fly", case, "--fragments", own, "--out", tmp_path / "out", "--json")
    assert done.exit_code == 0, done.stderr
    assert "1 fragments (0.02 kg) ended the burst up to 0.1 m below the ground" in done.stderr
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
    assert "one realisation of the break-up was flown" in done.stderr
