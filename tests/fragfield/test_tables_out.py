"""Tables as users read them: CSV files of a run in pandas without options, one workbook of all, the guide's page."""

from __future__ import annotations

import contextlib
import re
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pytest

import fragfield
from tests.fragfield.short_run import invoke

PAGE = Path(__file__).resolve().parents[2] / "docs" / "guide" / "your_test_data.md"
CASE = """title = "=1+1, an arena test"
[site]
latitude = "51.5 deg"
longitude = "7 deg"
bearing = "90 deg"
[[witness]]
name = "ring"
radius = "5 m"
bottom = "0 m"
top = "3 m"
[[obstacle]]
name = "wall, north"
kind = "wall"
start = ["-5 m", "8 m"]
end = ["5 m", "8 m"]
height = "2 m"
"""
FIRST_COLUMNS = {"zone_from_deg", "realisation", "id", "distance_m", "azimuth_deg", "fragment", "name"}


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """A flight of a few fragments at a wall, through a ring."""
    folder = tmp_path_factory.mktemp("tables")
    (folder / "case.toml").write_text(CASE)
    draw = np.random.default_rng(2)
    velocity = 300.0 * draw.normal(size=(60, 3))
    velocity[:, 2] = abs(velocity[:, 2]) * 0.2
    velocity[:20] = np.column_stack([draw.uniform(-80, 80, 20), np.full(20, 400.0), np.zeros(20)])
    rows = [f"{0.05},{x!r},{y!r},{z!r},1.0" for x, y, z in velocity.tolist()]
    (folder / "f.csv").write_text("\n".join(["mass_kg,vx_m_s,vy_m_s,vz_m_s,z_m", *rows]))
    done = invoke("fly", folder / "case.toml", "--fragments", folder / "f.csv", "--out", folder / "run")
    assert done.exit_code == 0, done.output
    return fragfield.open(folder / "run")


def test_pandas_reads_every_csv_without_options(run):
    files = sorted(run.path.glob("*.csv"))
    assert len(files) == 7
    for path in files:
        frame = pd.read_csv(path)
        assert frame.columns[0] in FIRST_COLUMNS, path
        assert not [name for name in frame.columns if name.startswith(("Unnamed", "#"))]
        assert len(frame) == len(path.read_text().splitlines()) - 1 > 0
    hits = pd.read_csv(run.path / "obstacle_hits.csv")
    assert set(hits["name"]) == {"wall, north"}
    assert set(hits["face_name"]) <= {"front", "back", "left", "right", "top"}
    landing = pd.read_csv(run.path / "landing.csv")
    assert set(landing["status_text"]) == {"landed", "stopped"}


def test_one_workbook_holds_all_tables(run, tmp_path):
    done = invoke("tables", str(run.path), "--out", str(tmp_path / "all.xlsx"))
    assert done.exit_code == 0, done.output
    book = openpyxl.load_workbook(tmp_path / "all.xlsx")
    assert book.sheetnames == ["summary", *run.tables]
    keys = {row[0].value: row[1].value for row in book["summary"].iter_rows()}
    assert keys["title"] == "'=1+1, an arena test"  # no formula
    assert keys["flight.fragments"] == 60
    assert {"program_version", "seed"} <= set(keys)
    for name in run.tables:
        table = run.table(name)
        frame = pd.read_excel(tmp_path / "all.xlsx", sheet_name=name)
        assert list(frame.columns) == list(table.columns)
        assert len(frame) == len(table)
        for column in table.columns:
            if table[column].dtype.kind == "f":
                exact = pytest.approx(table[column].to_numpy(), rel=1e-15, nan_ok=True)
                assert frame[column].astype(float).to_numpy() == exact


def test_a_workbook_is_refused_in_one_line(run, tmp_path):
    wrong = invoke("tables", str(run.path), "--out", str(tmp_path / "all.csv"))
    assert wrong.exit_code == 2
    assert "tables are written as .xlsx; name it so" in wrong.output


def test_the_guides_page_says_what_the_command_prints(tmp_path):
    """Its file is written, imported, and every line of the page's listing is printed."""
    blocks = re.findall(r"^```(\w+)\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    with contextlib.chdir(tmp_path):
        for language, text in blocks:
            if language == "python":
                exec(text, {})
        done = invoke("import", "arena_12.csv", "--casing-mass", "23.5 kg", "--out", "arena.csv")
    assert done.exit_code == 0, done.output
    (listing,) = (text for language, text in blocks if language == "output")
    output = done.output.replace(f"{tmp_path}/", "").splitlines()  # a command of its own names files from its folder
    missing = [line for line in listing.splitlines() if line.strip() != "..." and line not in output]
    assert missing == []
