"""A study of uncertainty as a whole: the same on any number of workers, resumed, with workers killed, and its files."""

from __future__ import annotations

import csv
import json
import threading
from concurrent.futures import BrokenExecutor
from pathlib import Path

import numpy as np
import pytest

import fragfield
from fragfield.files.run_directory import RunDirectory, read_stamped_json
from fragfield.results.summary import Summary
from fragfield.studies.study import Journal
from fragfield.studies.uncertainty.study import Uncertainty
from fragfield.studies.workers import Outcome
from tests.fragfield.example_results import complete
from tests.fragfield.run_tasks import in_threads
from tests.fragfield.short_run import invoke

ROOT = Path(__file__).parents[2]
M107, PAIR = ROOT / "cases" / "m107_tnt.toml", ROOT / "cases" / "m107_pair.toml"
CONVERGENCE = {"reason": "", "quantities": {"expected_distance": {"uncertainty": 5.0, "kind": "monotone"}}}
SUMMARY = complete(
    Summary,
    {
        "burst": {"mean_initial_speed": 980.0, "speed_quantiles": {"99": 1370.0}},
        "break_up": {"fragments": 2500},
        "hazard": {
            "method": "realisations",
            "determined": True,
            "expected": 100.0,
            "upper": 103.0,
            "standard_error": 1.5,
        },
        "convergence": CONVERGENCE,
        "exposed": [],
    },
)


def _distance(case):
    """A made-up law of the inputs, with an error that the sample's seed draws."""
    noise = np.random.default_rng(case["seed"]).normal(0.0, 1.0)
    heat = float(case["round"][0]["explosive"]["heat_of_detonation"].split()[0]) / 4.52e6
    return 100.0 + 100.0 * (heat - 1.0) - 30.0 * (case["flight"]["drag_factor"] - 1.0) + noise


def _answer(task):
    if task.only == "burst":
        return Outcome(0, "", {})
    found = {
        "distance": _distance(task.case), "standard_error": 1.0, "determined": True, "reason": "",
        "mean_initial_speed": 980.0, "speed_99": 1370.0, "fragments": 2500, "exposed": [],
    }  # fmt: skip
    return Outcome(0, "", found)


@pytest.fixture
def made(monkeypatch, tmp_path):
    """Samples by a made-up law in place of runs; the tasks that were made, and codes that replace answers."""
    tasks, codes, guard = [], [], threading.Lock()

    def call(task):
        with guard:
            tasks.append(task)
            code = codes.pop(0) if codes else 0
        if code < 0:
            raise BrokenExecutor
        return _answer(task) if code == 0 else Outcome(code, f"ended with {code}")

    directory = RunDirectory(tmp_path / "nominal_run")
    directory.make()
    directory.write_summary(SUMMARY)
    in_threads(monkeypatch, call)
    monkeypatch.setattr(Uncertainty, "_nominal", lambda _: directory)
    for name in ("write_report", "write_uncertainty_page"):
        monkeypatch.setattr(f"fragfield.studies.uncertainty.study.{name}", lambda *_: None)
    return tasks, codes


def _invoke(out, *options, case=M107):
    return invoke("uncertainty", case, "--out", out, "--quiet", *options)


def read_results(folder):
    return read_stamped_json(folder / "uncertainty.json")


def _without_cost(folder):
    return {key: value for key, value in read_results(folder).items() if key not in ("cost", "nominal_run")}


def test_one_and_two_workers_give_the_same(made, tmp_path):
    for workers in (1, 2):
        done = _invoke(tmp_path / str(workers), "--samples", 40, "--jobs", workers)
        assert done.exit_code == 0, done.output
    assert (tmp_path / "1" / "samples.csv").read_bytes() == (tmp_path / "2" / "samples.csv").read_bytes()
    assert _without_cost(tmp_path / "1") == _without_cost(tmp_path / "2")
    assert _invoke(tmp_path / "3", "--samples", 40, "--seed", 9).exit_code == 0
    assert (tmp_path / "1" / "samples.csv").read_bytes() != (tmp_path / "3" / "samples.csv").read_bytes()


def test_the_law_comes_back(made, tmp_path):
    """Shares and quantiles of a law that is known: heat normal with 5 %, drag triangular within 15 %, error 1 m."""
    done = _invoke(tmp_path / "out", "--samples", 400)
    assert done.exit_code == 0, done.output
    found = read_results(tmp_path / "out")
    heat, drag = 25.0, 9e2 * 0.15**2 / 6.0
    by_name = {one["name"]: one for one in found["distance"]["shares"]}
    for name, share in (("heat of detonation", heat), ("drag coefficient", drag), ("softening", 0.0)):
        one = by_name[name]
        assert abs(one["share"] - share / (heat + drag)) < 3.0 * one["share_standard_error"] + 0.01, name
    spread = found["distance"]["spread"]
    assert spread["standard_deviation"] == pytest.approx(np.sqrt(heat + drag), rel=0.08)
    assert spread["statistical_error"] == 1.0
    hazard = found["hazard"]
    assert (hazard["parts"]["expected"], hazard["parts"]["grid"]) == (100.0, 5.0)
    assert hazard["parts"]["randomness"] == pytest.approx(3.0)
    assert hazard["parts"]["inputs"] == spread["high"] - 100.0
    nominal = RunDirectory(Path(found["nominal_run"])).summary()
    assert {key: nominal["hazard"][key] for key in hazard} == hazard
    assert nominal["distance_to_apply"]["computed"] == hazard["recommended"]
    bars = {one["name"]: one["high"] - one["low"] for one in found["distance"]["tornado"]}
    assert bars["heat of detonation"] == pytest.approx(2 * 1.645 * 5.0, rel=0.1)
    assert bars["drag coefficient"] < -4.0
    rows = list(csv.DictReader((tmp_path / "out" / "samples.csv").open()))
    assert len(rows) == found["design"]["samples"]
    assert {row["state"] for row in rows} == {"done"}


def test_a_killed_study_goes_on_and_is_the_same(made, tmp_path, monkeypatch):
    requests, _ = made
    whole, cut = tmp_path / "whole", tmp_path / "cut"
    assert _invoke(whole, "--samples", 30).exit_code == 0
    plain, count = Journal.add, []

    def add(journal, row):
        plain(journal, row)
        count.append(row)
        if len(count) == 12:
            raise KeyboardInterrupt

    monkeypatch.setattr(Journal, "add", add)
    assert _invoke(cut, "--samples", 30, "--jobs", 2).exit_code == 130
    monkeypatch.setattr(Journal, "add", plain)
    with (cut / "uncertainty.jsonl").open("a") as file:
        file.write('{"name": "sample 29", "exit_code": 0, "resul')  # what a crash leaves of a line
    requests.clear()
    done = _invoke(cut, "--samples", 30, "--resume")
    assert done.exit_code == 0, done.output
    assert len(requests) == 30 - 12
    assert (whole / "samples.csv").read_bytes() == (cut / "samples.csv").read_bytes()
    assert _without_cost(whole) == _without_cost(cut)
    requests.clear()
    assert _invoke(cut, "--samples", 30, "--resume").exit_code == 0
    assert requests == []


def test_samples_of_a_killed_worker_are_made_again_by_resume(made, tmp_path):
    _, codes = made
    whole, killed = tmp_path / "whole", tmp_path / "killed"
    assert _invoke(whole, "--samples", 20).exit_code == 0
    codes += [0, -9]
    done = _invoke(killed, "--samples", 20, "--jobs", 1)
    assert done.exit_code == 3, done.output
    assert "a process was killed, for want of memory or by a signal; --resume makes its runs again" in done.output
    assert _invoke(killed, "--samples", 20, "--resume").exit_code == 0
    assert (whole / "samples.csv").read_bytes() == (killed / "samples.csv").read_bytes()


def test_failed_samples_are_counted_and_left_out(made, tmp_path):
    _, codes = made
    codes += [0, 3, -9]
    out = tmp_path / "out"
    done = invoke("uncertainty", M107, "--out", out, "--samples", "40", "--jobs", "1")
    assert done.exit_code == 3, done.output
    assert "2 of 40 samples gave no distance and are left out" in done.output
    assert "sample 1: exit code 3: ended with 3" in done.output
    found = read_results(out)
    assert found["states"] | {"messages": None} == {
        "done": 38, "failed": 2, "not_determined": 0, "missing": 0, "messages": None,
    }  # fmt: skip
    assert found["distance"]["spread"]["samples"] == 38
    states = [row["state"] for row in csv.DictReader((out / "samples.csv").open())]
    assert states[:3] == ["done", "failed", "failed"]
    assert _invoke(out, "--samples", 40, "--resume").exit_code == 0  # made again: nothing fails any more


def test_a_distance_that_is_not_determined_is_said(made, tmp_path, monkeypatch):
    def call(task):
        outcome = _answer(task)
        if outcome.results["distance"] >= 96.0:
            return outcome
        reason = "mass has not landed"
        none = {"distance": None, "standard_error": None, "determined": False, "reason": reason}
        return Outcome(0, reason, outcome.results | none)

    in_threads(monkeypatch, call)
    for option in ([], ["--resume"]):
        done = _invoke(tmp_path / "out", "--samples", 60, "--json", *option)
        assert done.exit_code == 3
        states = json.loads(done.stdout)["states"]
        assert states["not_determined"] > 0
        assert states["done"] + states["not_determined"] == 60
        assert "not determined: mass has not landed" in states["messages"][0]


def test_in_python_and_where_no_sample_gives_a_distance(made, tmp_path):
    found = fragfield.run_uncertainty(M107, out=tmp_path / "out", samples=60, seed=3, jobs=2, progress=False)
    low, median, high = found.spread
    assert low < median < high < found.recommended
    assert found.recommended == found.found.hazard.recommended
    assert found.effects["share"].sum() == pytest.approx(1.0)
    assert str(found).splitlines()[0].startswith("Distance to apply: ")
    made[1].extend([3] * 60)
    lost = fragfield.run_uncertainty(M107, out=tmp_path / "lost", samples=60, progress=False)
    with pytest.raises(fragfield.NotDeterminedError, match="0 samples gave a distance; at least 8 are needed"):
        _ = lost.recommended
    assert lost.effects.empty


def test_the_terminal_prints_the_distance_to_apply(made, tmp_path):
    done = invoke("uncertainty", M107, "--out", tmp_path / "out", "--samples", "60")
    to_apply = read_results(tmp_path / "out")["distance_to_apply"]
    assert to_apply["line"] in done.stdout.splitlines()
    assert "recommended distance " in done.stdout


def test_another_study_is_not_mixed_in(made, tmp_path):
    out = tmp_path / "out"
    assert _invoke(out, "--samples", 20).exit_code == 0
    before = (out / "uncertainty.jsonl").read_bytes()
    for options, message in (
        ((), "holds a study of uncertainty; allowed: --resume to continue it, --overwrite to compute it again"),
        (("--resume", "--samples", 21), "this one differs in samples, points; use another --out, or --overwrite"),
        (("--resume", "--samples", 20, "--seed", 5), "this one differs in seed, points"),
        (("--resume", "--samples", 20, "--set", "burst.cell_size=5 mm"), "this one differs in case"),
    ):
        done = _invoke(out, *options)
        assert done.exit_code == 2
        assert message in done.stderr
        assert (out / "uncertainty.jsonl").read_bytes() == before
    assert _invoke(out, "--samples", 21, "--overwrite").exit_code == 0
    assert read_results(out)["design"]["samples"] == 21


def test_a_pair_makes_its_few_bursts_first(made, tmp_path):
    requests, _ = made
    done = _invoke(tmp_path / "out", "--samples", 30, "--jobs", 2, "--set", "uncertainty.bursts=8", case=PAIR)
    assert done.exit_code == 0, done.output
    assert [task.only for task in requests[:8]] == ["burst"] * 8
    samples = [task for task in requests if task.sample]
    assert len(samples) == 30
    assert {task.burst for task in samples} == {task.directory for task in requests[:8]}
    found = read_results(tmp_path / "out")
    assert found["design"]["bursts"] == 8
    assert "three dimensions" in found["design"]["geometry"]
    assert max(found["distance"]["shares"], key=lambda one: one["share"])["name"] == "heat of detonation"


def test_a_burst_that_fails_ends_the_study(made, tmp_path):
    made[1].extend([3])
    done = _invoke(tmp_path / "out", "--samples", 30, "--jobs", 1, case=PAIR)
    assert done.exit_code == 2
    assert "burst 1 of 12 failed (exit code 3): ended with 3" in done.stderr
