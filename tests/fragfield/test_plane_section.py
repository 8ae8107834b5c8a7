"""`burst.geometry = "plane"`: what it takes and refuses, what `check`, log, summary and report say of it."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from fragfield.case.conversion.geometry import burst_geometry
from fragfield.case.conversion.stages import burst_settings
from fragfield.case.load import case_from_document
from fragfield.checking.check import check_report
from fragfield.checking.show import print_check
from fragfield.errors import InputError, exit_code_of
from fragfield.terminal.show import summary_text
from tests.fragfield.short_run import invoke

TUBE = {"profile": "tube", "explosive": "tnt", "casing": "steel_paper", "ignition": [{"station": "nose"}]}
WORDS = "plane section: no axial flow"
CASE = """
title = "Two tubes in a section"
[burst]
cell_size = "8 mm"
geometry = "plane"
end_time = "40 us"
[[round]]
name = "tube"
profile = "tube"
explosive = "tnt"
casing = "steel_paper"
position = ["0 m", "0 m", "1 m"]
[stack]
arrangement = "row"
count = 2
gap = "21.7 mm"
"""


def case(burst=None, second=None, **changes):
    rounds = [
        {**TUBE, "name": "one", "position": ["0 m", "0 m", "1 m"], **changes},
        {**TUBE, "name": "two", "position": ["0.3 m", "0 m", "1 m"], **(second or {})},
    ]
    document = {"burst": {"cell_size": "6 mm", "geometry": "plane", **(burst or {})}, "round": rounds}
    return case_from_document(document, source="my.toml", folder=Path())


def refused(**options):
    with pytest.raises(InputError) as found:
        case(**options)
    assert exit_code_of(found.value) == 2
    return str(found.value)


def test_it_is_computed_where_it_is_asked_for_and_there_alone():
    found = burst_geometry(case())
    assert found.words == f'{WORDS}: asked for by burst.geometry = "plane"'
    assert burst_settings(case()).geometry == "plane"
    assert burst_settings(case()).section_station is None
    assert burst_settings(case({"section_station": "100 mm"})).section_station == pytest.approx(0.1)
    assert burst_geometry(case({"geometry": "auto"})).geometry == "3d"


def test_bad_sections_are_refused_by_key_found_and_allowed():
    words = refused(burst={"section_station": "310 mm"})
    assert "burst.section_station: found geometry" in words
    assert "cuts round 'one' at station 310 mm, where it has no charge; its charge lies between 0 and 300 mm" in words
    words = refused(second={"axis": [0, 1, 1]})
    assert "burst.geometry: found" in words
    assert "'two' is not parallel to that of 'one'" in words
    assert "cuts round 'two' at station 450 mm" in refused(second={"position": ["0.3 m", "0 m", "1.3 m"]})
    shock = {"ignition": [], "initiation": {"pressure": "5 GPa", "duration": "0.2 us"}}
    assert "may be initiated by shock" in refused(second=shock)
    words = refused(burst={"geometry": "3d", "section_station": "100 mm"})
    assert 'burst.section_station: found 100 mm with burst.geometry = "3d"; allowed with geometry = "plane"' in words
    assert "burst.section_station" in refused(burst={"section_station": "-1 mm"})


def test_check_reports_masses_per_metre_and_what_it_is(capsys):
    one = case()
    found = check_report(one)
    assert found["geometry"]["words"] == WORDS
    assert found["rounds"][0]["casing_mass_per_metre"] == pytest.approx(7800.0 * np.pi * (0.0775**2 - 0.055**2))
    assert found["rounds"][0]["section_station"] == pytest.approx(0.15, abs=1e-6)
    assert 400 < found["mesh"]["cells"] < 650  # one round; the other is its image
    (plane,) = found["symmetry"]["planes"]
    assert plane["through_rounds"] == []
    assert any(WORDS.capitalize() in text for text in found["warnings"])
    print_check(found, one)
    out = capsys.readouterr().out
    assert WORDS in out
    assert "kg/m" in out


@pytest.mark.dolfinx
def test_the_burst_runs_and_every_page_says_what_it_is(tmp_path, quick_report):
    """Break-up, flight and the whole run say why they cannot follow; nothing is written by a refused run."""
    path, out = tmp_path / "pair.toml", tmp_path / "out"
    path.write_text(CASE)
    done = invoke("run", path, "--out", tmp_path / "never")
    assert done.exit_code == 2
    assert 'burst.geometry: found "plane"; `fragfield run` cannot be computed from a plane section' in done.stderr
    assert 'use "auto", "axisymmetric" or "3d"' in done.stderr
    assert not (tmp_path / "never").exists()
    done = invoke("burst", path, "--out", out, "--json")
    assert done.exit_code == 0, done.stderr
    summary = json.loads((out / "summary.json").read_text())["burst"]
    assert summary["geometry"] == "plane"
    assert summary["section"]["words"] == WORDS
    assert set(summary["section"]["focus"]["mass_ratio"]) == {"5", "10", "20", "35"}
    assert len(summary["section"]["by_azimuth"]) == 72
    assert WORDS in (out / "run.log").read_text()
    for stage in ("break-up", "fly"):
        done = invoke(stage, out)
        assert done.exit_code == 2
        assert f"`fragfield {stage}` cannot be computed from a plane section" in done.stderr
    done = invoke("report", out)
    assert done.exit_code == 0, done.stderr
    page = (out / "report.html").read_text()
    assert page.count(WORDS.capitalize()) >= 2
    assert "Mass within 10" in page
    assert "Quadrilaterals of the section" in page


def test_the_summary_of_a_run_shows_the_section_and_its_focus() -> None:
    section = {"words": "plane section at 200 mm", "focus": {"mass_ratio": {"5": 3.25, "15": 1.5}}}
    shown = summary_text({"burst": {"section": section}})
    assert "plane section at 200 mm" in shown
    assert "masses per metre" in shown
    assert [" ".join(line.split()) for line in shown.splitlines() if "focus" in line] == [
        "burst mass within 5 deg of the focus 3.25 per degree",
        "burst mass within 15 deg of the focus 1.5 per degree",
    ]
    assert "masses per metre" in summary_text({"burst": {"section": {**section, "focus": None}}})
