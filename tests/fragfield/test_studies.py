"""Sweeps, comparisons and studies of uncertainty from Python: the same as the commands, which stand on them."""

from __future__ import annotations

import json
import math

import pytest

import fragfield
import fragfield.studies.uncertainty as package
from tests.fragfield.short_run import invoke
from tests.fragfield.test_sweep import TUBE, calls

__all__ = ["calls"]  # the fixture, for pytest

FOUND = {
    "design": {"samples": 8},
    "states": {"failed": 0},
    "distance": {
        "spread": {"low": 90.2, "median": 110.0, "high": 133.4},
        "shares": [{"name": "prefactor", "share": 0.7, "share_standard_error": 0.1}],
    },
    "hazard": {
        "recommended": 141.2,
        "not_included": {},
        "parts": {"expected": 108.0, "quadrature": None, "randomness": 3.0, "grid": 5.0, "inputs": 30.0},
    },
    "distance_to_apply": {"line": "Distance to apply: 381 m (storage and handling)", "words": []},
    "exit_code": 0,
}


def test_a_sweep_gives_its_runs_and_one_table(calls, tmp_path):
    made, codes = calls
    codes += [0, 3]
    found = fragfield.run_sweep(
        TUBE,
        {"burst.cell_size": ["12 mm", "15 mm"], "seed": [7]},
        out=tmp_path / "out",
        jobs=1,
        keep_runs=True,
        progress=False,
    )
    assert len(made) == 2
    table = found.table
    assert list(table["burst.cell_size"]) == ["12 mm", "15 mm"]
    assert list(table["seed"]) == [7, 7]
    assert list(table["state"]) == ["done", "failed"]
    assert table["mean_initial_speed"][0] == 1000.0
    assert math.isnan(table["mean_initial_speed"][1])
    assert [run.path.name for run in found.runs] == [found.found["runs"][0]["name"]]
    assert list(found.failures.values()) == ["cell 7 is lost"]
    assert "2 runs over burst.cell_size, seed" in str(found)
    assert repr(found).endswith("2 runs, 1 failed>")


def test_a_case_made_in_python_is_swept_from_its_file(calls, tmp_path):
    case = fragfield.Case.from_toml(TUBE, set={"seed": 11})
    with pytest.raises(fragfield.InputError, match=r"burst\.cell_size: found '12 mm'; needed: a list of its values"):
        fragfield.run_sweep(case, {"burst.cell_size": "12 mm"}, out=tmp_path / "out")
    found = fragfield.run_sweep(case, {"burst.cell_size": ["12 mm"]}, out=tmp_path / "out", progress=False)
    assert fragfield.Case.from_toml(tmp_path / "out.toml") == case
    assert found.runs == []
    again = fragfield.run_sweep(
        case, {"burst.cell_size": ["12 mm"]}, out=tmp_path / "two", keep_runs=True, progress=False
    )
    assert again.runs[0].case.values.seed == 11
    made = fragfield.Case(title="made", burst={"cell_size": "9 mm"}, round=[
        {"name": "a", "profile": "tube", "explosive": "tnt", "casing": "steel_paper", "position": ["0 m", "0 m", "1 m"]}
    ])  # fmt: skip
    with pytest.raises(fragfield.InputError, match=r"out: missing; a case made in Python needs a folder"):
        fragfield.run_sweep(made, {"seed": [1]})


def test_a_study_of_uncertainty_passes_what_is_asked_and_gives_the_distance(tmp_path, monkeypatch):
    asked = []
    monkeypatch.setattr(package, "run_study", lambda request, options: asked.append((request, options)) or dict(FOUND))
    found = fragfield.run_uncertainty(TUBE, out=tmp_path / "study", samples=8, seed=3, jobs=2, progress=False)
    request, options = asked[0]
    assert request.target == TUBE
    assert (options.folder, options.samples, options.seed, options.jobs) == (tmp_path / "study", 8, 3, 2)
    assert options.quiet
    assert found.recommended == 141.2
    assert found.spread == (90.2, 110.0, 133.4)
    assert found.effects["share"][0] == 0.7
    assert str(found).splitlines()[0] == "Distance to apply: 381 m (storage and handling)"
    done = invoke("uncertainty", TUBE, "--out", tmp_path / "study", "--samples", "8", "--json")
    assert done.exit_code == 0, done.stderr
    assert json.loads(done.stdout) == FOUND
    monkeypatch.setattr(
        package, "run_study", lambda *_: {**FOUND, "distance": None, "states": {"reason": "none landed"}}
    )
    empty = fragfield.run_uncertainty(TUBE, out=tmp_path / "study", progress=False)
    with pytest.raises(fragfield.NotDeterminedError, match="none landed"):
        _ = empty.recommended
    assert str(empty.effects) == "effects: no rows"
