"""Contact between fragments and their presented areas from the case file to the files and the report."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from flight.files.hdf5 import read_table
from fragfield.cli import app
from fragfield.report.reading.run_files import read_run
from fragfield.report.tables.stages import flight_rows

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
    done = CliRunner().invoke(app, [*map(str, command), "--json"])
    assert done.exit_code == 0, done.stderr
    return json.loads(done.stdout)["flight"]


def rows_of_the_report(folder: Path) -> dict[str, tuple[str, str]]:
    (table,) = flight_rows(read_run(folder / "out"))
    return {row.name: (row.value, row.note.replace("\u00a0", " ")) for row in table.rows}


def test_impacts_in_summary_files_and_report(tmp_path) -> None:
    summary = fly(tmp_path, CASE)
    contacts = read_table(tmp_path / "out" / "contacts.h5", "contacts")[0]
    assert (tmp_path / "out" / "contacts.csv").is_file()
    assert len(contacts) == summary["contact"]["contacts"] == 1
    speed = contacts["closing_speed"][0]
    assert 950.0 < speed < 1000.0  # drag over a metre each
    # reduced mass 5 g, restitution 0.5
    assert summary["contact"]["energy_lost"] == pytest.approx(0.5 * 0.005 * speed**2 * 0.75, rel=1e-6)
    rows = rows_of_the_report(tmp_path)
    lost = summary["contact"]["energy_lost"] / 1e3
    assert rows["Impacts between fragments"][0] == "1"
    assert rows["Energy lost in them"][0] == f"{lost:.3f}\u00a0kJ"
    value, note = rows["Presented areas"]
    assert value == "box 5:2:1"
    low, high = (summary["presented_area"][f"shape_factor_{share}_percent"] for share in (5, 95))
    assert low == pytest.approx(high, rel=1e-12)  # boxes of one shape that tumble
    assert note == f"shape factor {low:,.0f} kg/m³"


def test_without_contact_nothing_of_it_is_left(tmp_path) -> None:
    fly(tmp_path, CASE)
    assert "contact" not in fly(tmp_path, '[flight]\ncollisions = "none"\n')
    assert not list((tmp_path / "out").glob("contacts.*"))
    rows = rows_of_the_report(tmp_path)
    assert rows["Presented areas"] == ("as given", "shape factor 2,600 kg/m³")
    assert "Impacts between fragments" not in rows
