"""The recommended distance of a run is one number: on the terminal, in every file, from Python, in a comparison."""

from __future__ import annotations

import json
import math
import re
from html import unescape
from xml.etree import ElementTree as ET

import pytest

import fragfield
from flight.arena import ArenaTable
from fragfield.results.part import to_json
from tests.flight.test_arena import burst
from tests.fragfield.plain_reports import leave_out_figures
from tests.fragfield.short_run import invoke

CASE = """title = "One number"
[site]
latitude = "51.5 deg"
longitude = "7 deg"
bearing = "90 deg"
[hazard]
max_realisations = 20
tolerance = 0.001
[[exposed]]
name = "gate"
position = ["40 m", "0 m"]
"""
KML = "{http://www.opengis.net/kml/2.2}"


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    """An arena test flown with its report, and what the terminal showed."""
    folder = tmp_path_factory.mktemp("one_number")
    ArenaTable.of([burst(seed) for seed in range(20)]).write(folder / "test.csv")
    (folder / "case.toml").write_text(CASE, encoding="utf-8")
    done = invoke("fly", folder / "case.toml", "--fragments", folder / "test.csv", "--out", folder / "run")
    assert done.exit_code == 0, done.stderr
    with pytest.MonkeyPatch.context() as patch:
        leave_out_figures(patch)
        report = invoke("report", folder / "run")
    assert report.exit_code == 0, report.stderr
    return folder / "run", done.stdout


def _metres(text):
    """Every recommended distance that a text names."""
    return {int(found) for found in re.findall(r"recommended distance[ ,:]*([0-9]+)\s*m\b", text, re.IGNORECASE)}


def test_every_output_says_the_same(run):
    folder, printed = run
    hazard = json.loads((folder / "summary.json").read_text())["hazard"]
    shown = math.ceil(hazard["recommended"])
    assert shown > math.ceil(hazard["expected"]) > 20  # so that no output could show the one for the other
    assert _metres(printed) == {shown}

    report = (folder / "report.html").read_text(encoding="utf-8")
    words = re.sub(
        r"\s+", " ", unescape(re.sub(r"<[^>]+>", " ", re.sub(r"(?s)<(style|script|svg).*?</\1>", " ", report)))
    )
    assert _metres(words) == {shown}

    assert _metres((folder / "map.html").read_text(encoding="utf-8")) == {shown}

    features = json.loads((folder / "contours.geojson").read_text())["features"]
    (circle,) = (one["properties"] for one in features if one["properties"].get("quantity") == "recommended")
    assert _metres(circle["name"]) == {shown}

    names = [one.text for one in ET.parse(folder / "contours.kml").getroot().iter(f"{KML}name")]
    assert set().union(*(_metres(one) for one in names if one)) == {shown}


def test_python_and_a_comparison_take_the_number_of_the_file(run):
    folder, _ = run
    hazard = json.loads((folder / "summary.json").read_text())["hazard"]
    opened = fragfield.open(folder)
    assert opened.hazard.recommended == hazard["recommended"]
    assert to_json(opened.hazard.parts) == hazard["parts"]
    ratios = fragfield.compare_runs(folder, opened)
    assert dict(zip(ratios["quantity"], ratios["run"], strict=True))["hazard.recommended"] == hazard["recommended"]
