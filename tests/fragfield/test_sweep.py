"""A sweep: its plan, its rows and directories, what it keeps, and its table when runs fail."""

from __future__ import annotations

import csv
import json
import shutil
from dataclasses import fields

import numpy as np
import pytest

import fragfield
from fragfield.case import load_case, load_changed_case, read_resolved
from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.results.summary import Summary
from fragfield.studies.sweep import plan_runs, results_of
from fragfield.studies.workers import Outcome, perform
from tests.fragfield.example_results import complete
from tests.fragfield.run_tasks import in_threads
from tests.fragfield.short_run import RINGS, ROOT, invoke

TUBE, PAIR = ROOT / "cases" / "tube.toml", ROOT / "cases" / "m107_pair.toml"
SUMMARY = {
    "burst": {"mean_initial_speed": 1000.0, "max_initial_speed": 1300.0, "energy_error": 0.004, "lost_cells": 0,
              "wall_seconds": 10.0},
    "break_up": {"fragments": 500},
    "flight": {"wall_seconds": 2.5},
    "hazard": {"realisations": 20, "recommended": 115.0, "expected": 110.0, "standard_error": 3.0, "determined": True,
               "parts": {"expected": 110.0, "quadrature": None, "randomness": 5.0, "grid": None, "table": None,
                         "inputs": None},
               "not_included": {"grid": "not computed for the runs of a sweep"},
               "single_event": {"median": 108.0, "low": 90.0, "high": 130.0}, "largest_throw": 700.0},
}  # fmt: skip


@pytest.fixture
def calls(monkeypatch):
    """Runs that are remembered and give a row, or leave their numbers in their directory; a code makes one fail."""
    made, codes, summary = [], [], {**SUMMARY}

    def call(task):
        made.append(task)
        if code := codes.pop(0) if codes else 0:
            return Outcome(code, "cell 7 is lost")
        if task.directory is not None:
            (task.directory / "burst_snapshot.h5").touch()
            RunDirectory(task.directory).write_summary(complete(Summary, summary))
        reason = "" if summary["hazard"]["determined"] else summary["hazard"]["reason"]
        return Outcome(0, reason, task.results(Summary.read(complete(Summary, summary))))

    in_threads(monkeypatch, call)
    return made, codes, summary


def test_a_plan_is_the_product_of_its_values():
    keys, runs = plan_runs(TUBE, ["burst.cell_size=12 mm,15 mm", "round.0.explosive=tnt,comp_b"])
    assert keys == ["burst.cell_size", "round.0.explosive"]
    assert [run.name for run in runs] == [
        "cell_size_12_mm_explosive_tnt", "cell_size_12_mm_explosive_comp_b",
        "cell_size_15_mm_explosive_tnt", "cell_size_15_mm_explosive_comp_b",
    ]  # fmt: skip
    assert runs[1].values == {"burst.cell_size": "12 mm", "round.0.explosive": "comp_b"}
    assert runs[1].case.burst.cell_size == pytest.approx(0.012)
    assert runs[1].case.round[0].explosive.name == "comp_b"
    assert runs[3].case.title.endswith(": burst.cell_size = 15 mm, round.0.explosive = comp_b")


@pytest.mark.parametrize(
    ("setting", "values"),
    [
        ("burst.leakage.radius_ratio=1.6, 2.1", [1.6, 2.1]),
        ("burst.leakage.enabled=true,false", [True, False]),
        ('title="A, B",C', ["A, B", "C"]),
        ('flight.origin=["0 m", "0 m"],["1 m", "0 m"]', [["0 m", "0 m"], ["1 m", "0 m"]]),
        ("hazard.density=1 / (55.7 m^2),0.1 / m^2", ["1 / (55.7 m^2)", "0.1 / m^2"]),
    ],
)  # fmt: skip
def test_values_are_read_as_in_a_case_file(setting, values):
    if setting.startswith("title"):  # changes nothing that is computed
        with pytest.raises(InputError, match="are alike; give every value once"):
            plan_runs(TUBE, [setting])
        return
    key = setting.partition("=")[0]
    assert [run.values[key] for run in plan_runs(TUBE, [setting])[1]] == values


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (["burst.cell_siz=8 mm"], 'burst.cell_siz: unknown key (did you mean "cell_size"?)'),
        (["brust.cell_size=8 mm"], 'brust: unknown key (did you mean "burst"?)'),
        (["burst.cell_size=8 mm,8"], "with burst.cell_size = 8: burst.cell_size: found the bare number 8 without"),
        (["round.0.explosive=tnt,tnd"], "round[1].explosive: explosive 'tnd' is unknown; did you mean 'tnt'?"),
        (["round.0.casing.densty=1 kg/m^3"], 'round[1].casing.densty: unknown key (did you mean "density"?)'),
        (["round.tub.casing=copper"], 'there is no entry tub (did you mean "tube"?); allowed: *, [1], tube'),
        (["round.1.casing=copper"], "round.1.casing: there is no entry 1; allowed: *, [1], tube"),
        (["plane.0.height=1 m"], "plane.0.height: the case has no plane; write its entries into the case file"),
        (["seed.first=1"], "seed.first: seed holds a value, it has no first"),
        (["burst..cell_size=8 mm"], "found the key 'burst..cell_size'"),
        (["burst.products=landau,lando"], 'burst.products: found "lando" (did you mean "landau"?); allowed: "landau"'),
        (["burst.cell_size"], "found 'burst.cell_size'; needed: KEY=VALUE[,VALUE...], for example"),
        (["burst.cell_size=8 mm,"], "needed: KEY=VALUE[,VALUE...]"),
        (["seed=1", "seed=2"], "seed is given twice"),
        (["burst.cell_size=8 mm,0.8 cm"], "burst.cell_size = 8 mm and burst.cell_size = 0.8 cm are alike"),
        (["seed=1", "--stage", "fly"], '--stage: found "fly"; allowed: run, burst'),
    ],
)  # fmt: skip
def test_what_cannot_run_is_refused_before_anything_runs(settings, message, tmp_path, calls):
    done = invoke("sweep", TUBE, *settings, "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert message in done.stderr
    assert not calls[0]
    assert not (tmp_path / "out").exists()


def test_a_name_is_opened_where_a_key_goes_into_its_table():
    changed = load_changed_case(PAIR, {"round.*.casing.shear_strength": "300 MPa", "stack.gap": "40 mm"})
    plain = load_case(PAIR)
    assert [entry.casing.shear_strength for entry in changed.round] == [3e8, 3e8]
    assert changed.round[0].casing.density == plain.round[0].casing.density
    gaps = [case.round[1].position[0] - case.round[0].position[0] for case in (changed, plain)]
    assert gaps[0] - gaps[1] == pytest.approx(0.04 - 0.0217)


@pytest.mark.parametrize("keep", [["--keep-runs"], []], ids=["directories", "rows"])
def test_a_failed_run_is_reported_and_the_others_go_on(tmp_path, calls, keep):
    made, codes, _ = calls
    codes += [0, 3, 0]
    out = tmp_path / "out"
    done = invoke("sweep", TUBE, "burst.cell_size=12 mm,15 mm,20 mm", "--out", out, "--jobs", "1", *keep)
    assert done.exit_code == 3, done.stderr
    assert [task.case.burst.cell_size for task in made] == [0.012, 0.015, 0.02]
    if keep:
        assert read_resolved(out / "cell_size_15_mm.toml").burst.cell_size == pytest.approx(0.015)
        assert made[0].directory == out / "cell_size_12_mm"
        assert fragfield.open(made[0].directory).case.values == made[0].case
    else:
        assert sorted(path.name for path in out.iterdir()) == ["sweep.csv", "sweep.json", "sweep.jsonl"]
    assert "cell_size_15_mm failed (exit code 3): cell 7 is lost" in done.stdout
    for text in ("115", "110 ± 3.0", "90 to 130", "700", "do not include grid (not computed for the runs of a sweep)"):
        assert text in done.stdout, text
    rows = list(csv.DictReader((out / "sweep.csv").open()))
    assert [row["state"] for row in rows] == ["done", "failed", "done"]
    assert [row["burst.cell_size"] for row in rows] == ["12 mm", "15 mm", "20 mm"]
    assert (rows[0]["mean_initial_speed_m_s"], rows[1]["mean_initial_speed_m_s"]) == ("1000.0", "")
    assert (rows[0]["recommended_distance_m"], rows[0]["single_event_low_m"]) == ("115.0", "90.0")
    assert rows[0]["wall_seconds"] == "12.5"
    assert rows[1]["message"] == "cell 7 is lost"
    stored = json.loads((out / "sweep.json").read_text())
    assert stored["exit_code"] == 3
    assert stored["runs"][2]["results"]["largest_throw"] == 700.0


def test_a_run_whose_distance_is_not_determined_is_done_and_says_so(tmp_path, calls):
    reason = "there are no fragments"
    calls[2]["hazard"] = SUMMARY["hazard"] | {
        "recommended": None, "expected": None, "determined": False, "reason": reason,
    }  # fmt: skip
    arguments = ("sweep", TUBE, "burst.cell_size=12 mm,15 mm", "--out", tmp_path / "out", "--json")
    for option, state in ((), "done"), (("--resume",), "kept"):
        done = invoke(*arguments, *option)
        assert done.exit_code == 3, done.output
        for row in json.loads(done.stdout)["runs"]:
            assert (row["state"], row["exit_code"], row["message"]) == (state, 3, reason)
            assert row["results"]["recommended_distance"] is None
            assert row["results"]["mean_initial_speed"] == 1000.0
    assert "not determined" in invoke("sweep", TUBE, "burst.cell_size=12 mm", "--out", tmp_path / "other").stdout


@pytest.mark.parametrize("keep", [["--keep-runs"], []], ids=["directories", "rows"])
def test_resume_keeps_finished_runs_of_the_same_case(tmp_path, calls, keep):
    made, codes, _ = calls
    codes += [0, 3]
    out = tmp_path / "out"
    options = ("--out", out, "--json", "--jobs", "1", *keep)
    arguments = ("sweep", TUBE, "burst.cell_size=12 mm,15 mm", *options)
    assert invoke(*arguments).exit_code == 3
    before = (out / "sweep.jsonl").read_bytes()
    refused = invoke(*arguments)
    assert refused.exit_code == 2
    assert f"{out}: holds a study of sweep; allowed: --resume to continue it, --overwrite to compute" in refused.stderr
    assert (out / "sweep.jsonl").read_bytes() == before
    done = invoke(*arguments, "--resume")
    assert done.exit_code == 0
    assert [row["state"] for row in json.loads(done.stdout)["runs"]] == ["kept", "done"]
    assert len(made) == 3
    more = invoke("sweep", TUBE, "burst.cell_size=12 mm,20 mm", *options, "--resume")
    assert [row["state"] for row in json.loads(more.stdout)["runs"]] == ["kept", "done"]
    again = invoke(*arguments, "--resume")  # the row that the last table does not list is kept too
    assert [row["state"] for row in json.loads(again.stdout)["runs"]] == ["kept", "kept"]
    assert invoke(*arguments, "--overwrite").exit_code == 0
    assert len(made) == 6


def test_a_row_whose_line_was_cut_off_or_whose_directory_is_gone_is_made_again(tmp_path, calls):
    out = tmp_path / "out"
    arguments = ("sweep", TUBE, "burst.cell_size=12 mm,15 mm,20 mm", "--out", out, "--json", "--jobs", "1")
    assert invoke(*arguments, "--keep-runs").exit_code == 0
    shutil.rmtree(out / "cell_size_12_mm")
    journal = out / "sweep.jsonl"
    journal.write_bytes(journal.read_bytes()[:-20])
    (out / "sweep.json").write_text("{")  # the table is written, never read
    done = invoke(*arguments, "--keep-runs", "--resume")
    assert [row["state"] for row in json.loads(done.stdout)["runs"]] == ["done", "kept", "done"]
    assert [json.loads(line)["name"] for line in journal.read_text().splitlines()[-2:]] == [
        "cell_size_12_mm", "cell_size_20_mm",
    ]  # fmt: skip


@pytest.mark.parametrize("keep", [["--keep-runs"], []], ids=["directories", "rows"])
def test_runs_of_another_case_are_refused_or_replaced(tmp_path, calls, keep):
    made, *_ = calls
    case, out = tmp_path / "case.toml", tmp_path / "out"
    case.write_text(TUBE.read_text())
    arguments = ("sweep", case, "burst.cell_size=12 mm", "--out", out, *keep)
    assert invoke(*arguments).exit_code == 0
    case.write_text(TUBE.read_text().replace("seed = 1", "seed = 2"))
    done = invoke(*arguments, "--resume")
    assert done.exit_code == 2
    words = ["run of another case; use another --out, or --overwrite", "seed: stored 1, now 2"]
    if not keep:
        words = [f"{out / 'sweep.jsonl'}: holds the run cell_size_12_mm of another case; use another --out"]
    assert all(one in done.stderr for one in words), done.stderr
    assert invoke(*arguments, "--resume", "--stage", "burst").exit_code == 2
    assert len(made) == 1
    assert invoke(*arguments, "--overwrite").exit_code == 0
    assert len(made) == 2


@pytest.mark.dolfinx
@pytest.mark.parametrize("geometry", ["axisymmetric", "3d"])
def test_a_burst_without_files_ends_in_the_state_of_its_file(tmp_path, geometry):
    from burst_fenicsx import simulate
    from fragfield.case.conversion.rounds import burst_rounds
    from fragfield.case.problem import burst_settings
    from fragfield.pipeline.beside import burst_beside
    from fragfield.pipeline.parallel import Team
    from transition import Snapshot

    (tmp_path / "short.toml").write_text(RINGS)
    case = load_changed_case(tmp_path / "short.toml", {"burst.geometry": geometry, "burst.end_time": "15 us"})
    simulate(burst_rounds(case), burst_settings(case), tmp_path)
    _, state = burst_beside(case, Team())
    of_file = Snapshot.read(tmp_path / "burst_snapshot.h5")
    for name in (one.name for one in fields(Snapshot)):
        here, value = getattr(state, name), getattr(of_file, name)
        if isinstance(value, np.ndarray):
            assert (here.dtype, here.flags.c_contiguous) == (value.dtype, True)
            np.testing.assert_array_equal(here, value)
        elif name not in ("source", "provenance"):
            assert here == value


@pytest.mark.dolfinx
def test_a_row_has_the_numbers_of_its_run_and_a_burst_is_made_once(tmp_path, monkeypatch, without_figures):
    from burst_fenicsx import run_burst

    bursts, simulate = [], run_burst.simulate
    monkeypatch.setattr(
        "burst_fenicsx.simulate", lambda *asked, **options: bursts.append(1) or simulate(*asked, **options)
    )

    class Here:
        size = 1

        def submit(self, task):
            from concurrent.futures import Future

            future = Future()
            future.set_result(perform(task))
            return future

        def interrupt(self):
            pass

        close = restart = interrupt

    monkeypatch.setattr("fragfield.studies.study.workers_of", lambda *_, **__: Here())
    (tmp_path / "short.toml").write_text(RINGS)
    factors = {"flight.drag_factor": [1.0, 1.1]}
    rows = fragfield.run_sweep(tmp_path / "short.toml", factors, out=tmp_path / "rows", progress=False)
    assert not rows.failures
    assert len(bursts) == 1
    kept = fragfield.run_sweep(
        tmp_path / "short.toml", {"flight.drag_factor": [1.0]}, out=tmp_path / "runs", keep_runs=True, progress=False
    )
    found, other = (row.results for row in rows.rows)
    wanted = results_of(kept.runs[0].summary)
    assert kept.rows[0].results == wanted
    # A row flies no realisation where the distance is an integral: it has no band of single events.
    apart = ("wall_seconds", "realisations", "single_event_low", "single_event_high")
    assert {k: v for k, v in found.items() if k not in apart} == {k: v for k, v in wanted.items() if k not in apart}
    assert [found[name] for name in apart[1:]] == [0, None, None]
    assert other["largest_throw"] < found["largest_throw"]


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("case.toml", "holds a run; a sweep needs a folder of its own"),
        ("notes.txt", "holds notes.txt, which is no part of a study; allowed: a new or an empty folder, or a study's"),
    ],
)
def test_a_sweep_has_a_folder_of_its_own(tmp_path, calls, name, words):
    (tmp_path / name).touch()
    done = invoke("sweep", TUBE, "seed=1,2", "--out", tmp_path)
    assert done.exit_code == 2
    assert f"{tmp_path}: {words}" in done.stderr


def test_a_sweep_does_not_run_under_mpirun(tmp_path, calls, monkeypatch):
    monkeypatch.setenv("PMI_SIZE", "2")
    done = invoke("sweep", TUBE, "seed=1,2", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "it does not run under mpirun" in done.stderr


def test_an_interrupted_sweep_keeps_its_table(tmp_path, calls):
    calls[1].extend([0, 130])
    done = invoke("sweep", TUBE, "burst.cell_size=12 mm,15 mm,20 mm", "--out", tmp_path / "out", "--jobs", "1")
    assert done.exit_code == 130
    rows = json.loads((tmp_path / "out" / "sweep.json").read_text())["runs"]
    assert [row["state"] for row in rows] == ["done", "waiting", "waiting"]


def test_a_sweep_in_python(tmp_path, calls):
    case = fragfield.Case.from_toml(TUBE, set=["seed=11"])
    found = fragfield.run_sweep(case, {"burst.cell_size": ["12 mm", "15 mm"]}, out=tmp_path / "out", keep_runs=True)
    assert [run.case.values.seed for run in found.runs] == [11, 11]
    assert found.table["burst.cell_size"].tolist() == ["12 mm", "15 mm"]
    assert found.table["recommended_distance"].tolist() == [115.0, 115.0]
    assert str(found) == f"2 runs over burst.cell_size, in {tmp_path / 'out'}"
    made = fragfield.Case(title="made", burst={"cell_size": "9 mm"}, round=[
        {"name": "a", "profile": "tube", "explosive": "tnt", "casing": "steel_paper", "position": ["0 m", "0 m", "1 m"]}
    ])  # fmt: skip
    with pytest.raises(fragfield.InputError, match=r"out: missing; a case made in Python needs a folder"):
        fragfield.run_sweep(made, {"seed": [1]})
    with pytest.raises(fragfield.InputError, match=r"seed: found 1; needed: a list of its values, such as \[1\]"):
        fragfield.run_sweep(case, {"seed": 1}, out=tmp_path / "other")


@pytest.mark.slow
@pytest.mark.dolfinx
def test_real_bursts_of_which_one_stops(tmp_path):
    case = tmp_path / "short.toml"
    text = TUBE.read_text().replace('end_time = "120 us"', 'end_time = "6 us"\noutput = { interval = "6 us" }')
    case.write_text(text.replace('cell_size = "6 mm"', 'cell_size = "15 mm"'))
    arguments = (
        "sweep",
        case,
        "burst.energy_tolerance=1.0,1e-9",
        "--stage",
        "burst",
        "--out",
        tmp_path / "out",
        "--json",
    )
    done = invoke(*arguments)
    assert done.exit_code == 3, done.stderr
    sound, stopped = json.loads(done.stdout)["runs"]
    assert (sound["state"], sound["exit_code"], stopped["state"], stopped["exit_code"]) == ("done", 0, "failed", 3)
    assert "the energy ledger is open by" in stopped["message"]
    assert sound["results"]["mean_initial_speed"] > 0.0
    assert sound["results"]["recommended_distance"] is None
    again = json.loads(invoke(*arguments, "--resume").stdout)["runs"]
    assert [row["state"] for row in again] == ["kept", "failed"]
    assert again[0]["results"] == sound["results"]
