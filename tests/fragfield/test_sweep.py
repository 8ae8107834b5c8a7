"""A sweep: its plan, its rows and directories, what it keeps, and its table when runs fail."""

from __future__ import annotations

import csv
import json
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from fragfield.case import load_case, load_changed_case, read_resolved
from fragfield.errors import InputError
from fragfield.files.run_directory import RunDirectory
from fragfield.studies.processes import LocalRuns, perform
from fragfield.studies.sweep import plan_sweep
from fragfield.studies.sweep.results import results_of
from tests.fragfield.run_tasks import answer
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
    """Runs that are remembered and give a row or leave a finished directory; a code in the list makes one fail."""
    made, codes = [], []

    def call(_worker, request):
        made.append(request)
        if request["stage"] == "row":
            code = codes.pop(0) if codes else 0
            return code, "cell 7 is lost" if code else json.dumps({"results": results_of(SUMMARY), "message": ""})
        out = Path(request["out"])
        out.mkdir(exist_ok=True)
        RunDirectory(out).write_case(read_resolved(Path(request["case_file"])))
        if code := codes.pop(0) if codes else 0:
            return code, "cell 7 is lost"
        for name in ("burst_snapshot.h5", "fragments.h5", "landing.h5"):
            (out / name).touch()
        others = {
            name: []
            for name in ("witness", "obstacle", "exposed", "rules", "official", "distance_to_apply", "convergence")
        }
        RunDirectory(out).write_summary({**SUMMARY, **others})
        return 0, ""

    monkeypatch.setattr(LocalRuns, "call", call)
    return made, codes


def test_a_plan_is_the_product_of_its_values():
    plan = plan_sweep(TUBE, ["burst.cell_size=12 mm,15 mm", "round.0.explosive=tnt,comp_b"])
    assert [run.name for run in plan.runs] == [
        "cell_size_12_mm_explosive_tnt", "cell_size_12_mm_explosive_comp_b",
        "cell_size_15_mm_explosive_tnt", "cell_size_15_mm_explosive_comp_b",
    ]  # fmt: skip
    assert plan.runs[1].values == {"burst.cell_size": "12 mm", "round.0.explosive": "comp_b"}
    assert plan.runs[1].case.burst.cell_size == pytest.approx(0.012)
    assert plan.runs[1].case.round[0].explosive.name == "comp_b"
    assert plan.runs[3].case.title.endswith(": burst.cell_size = 15 mm, round.0.explosive = comp_b")


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
            plan_sweep(TUBE, [setting])
        return
    key = setting.partition("=")[0]
    assert [run.values[key] for run in plan_sweep(TUBE, [setting]).runs] == values


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
    made, codes = calls
    codes += [0, 3, 0]
    out = tmp_path / "out"
    done = invoke("sweep", TUBE, "burst.cell_size=12 mm,15 mm,20 mm", "--out", out, "--jobs", "1", *keep)
    assert done.exit_code == 3, done.stderr
    assert len(made) == 3
    if keep:
        assert made[0] == {"stage": "run", "case_file": str(out / "cell_size_12_mm.toml"),
                           "out": str(out / "cell_size_12_mm"), "resume": False, "overwrite": False}  # fmt: skip
        assert read_resolved(out / "cell_size_15_mm.toml").burst.cell_size == pytest.approx(0.015)
    else:
        assert (made[0]["of"], pickle.loads(pickle.dumps(made[0]["case"])).burst.cell_size) == ("run", 0.012)
        assert sorted(path.name for path in out.iterdir()) == ["sweep.csv", "sweep.json"]
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


def test_a_run_whose_distance_is_not_determined_is_done_and_says_so(tmp_path, calls, monkeypatch):
    plain = LocalRuns.call
    reason = "there are no fragments"

    def call(worker, request):
        plain(worker, request)
        out = Path(request["out"])
        found = RunDirectory(out).summary()
        found["hazard"] |= {"recommended": None, "expected": None, "determined": False, "reason": reason}
        RunDirectory(out).write_summary(found)
        return 0, ""

    monkeypatch.setattr(LocalRuns, "call", call)
    done = invoke("sweep", TUBE, "burst.cell_size=12 mm,15 mm", "--out", tmp_path / "out", "--json", "--keep-runs")
    found = json.loads(done.stdout)
    assert (done.exit_code, found["exit_code"]) == (3, 3)
    for row in found["runs"]:
        assert (row["state"], row["exit_code"], row["message"]) == ("done", 3, reason)
        assert row["results"]["recommended_distance"] is None
        assert row["results"]["mean_initial_speed"] == 1000.0
    kept = invoke("sweep", TUBE, "burst.cell_size=12 mm,15 mm", "--out", tmp_path / "out", "--json", "--resume")
    assert kept.exit_code == 3, kept.output
    assert [(row["state"], row["exit_code"]) for row in json.loads(kept.stdout)["runs"]] == [("kept", 3)] * 2
    done = invoke("sweep", TUBE, "burst.cell_size=12 mm", "--out", tmp_path / "other", "--keep-runs")
    assert "not determined" in done.stdout


@pytest.mark.parametrize("keep", [["--keep-runs"], []], ids=["directories", "rows"])
def test_resume_keeps_finished_runs_of_the_same_case(tmp_path, calls, keep):
    made, codes = calls
    codes += [0, 3]
    options = ("--out", tmp_path / "out", "--json", "--jobs", "1", *keep)
    arguments = ("sweep", TUBE, "burst.cell_size=12 mm,15 mm", *options)
    assert invoke(*arguments).exit_code == 3
    done = invoke(*arguments, "--resume")
    assert done.exit_code == 0
    assert [row["state"] for row in json.loads(done.stdout)["runs"]] == ["kept", "done"]
    assert len(made) == 3
    assert not keep or made[-1]["resume"]
    more = invoke("sweep", TUBE, "burst.cell_size=12 mm,20 mm", *options, "--resume")
    assert [row["state"] for row in json.loads(more.stdout)["runs"]] == ["kept", "done"]
    invoke(*arguments)  # without it all is made again
    assert len(made) == 6


@pytest.mark.parametrize("keep", [["--keep-runs"], []], ids=["directories", "rows"])
def test_runs_of_another_case_are_refused_or_replaced(tmp_path, calls, keep):
    made, _ = calls
    case = tmp_path / "case.toml"
    case.write_text(TUBE.read_text())
    arguments = ("sweep", case, "burst.cell_size=12 mm", "--out", tmp_path / "out", *keep)
    assert invoke(*arguments).exit_code == 0
    case.write_text(TUBE.read_text().replace("seed = 1", "seed = 2"))
    for option in ((), ("--resume",)):
        done = invoke(*arguments, *option)
        assert done.exit_code == 2
        words = ["run of another case; use another --out, or --overwrite", "seed: stored 1, now 2"]
        if not keep:
            words = [
                f"{tmp_path / 'out' / 'sweep.json'}: holds the run cell_size_12_mm of another case; use another --out"
            ]
        assert all(one in done.stderr for one in words), done.stderr
    assert len(made) == 1
    assert invoke(*arguments, "--overwrite").exit_code == 0
    assert not keep or made[-1]["overwrite"]


@pytest.mark.parametrize("text", ["{", "[]", '{"runs": [1]}', '{"runs": {"name": "x"}}'])
def test_a_damaged_table_is_named(tmp_path, calls, text):
    (tmp_path / "sweep.json").write_text(text)
    done = invoke("sweep", TUBE, "burst.cell_size=12 mm", "--out", tmp_path, "--resume")
    assert (done.exit_code, calls[0]) == (2, [])
    assert f"{tmp_path / 'sweep.json'}: is no table of a sweep; remove it, or use another --out" in done.stderr


@pytest.mark.dolfinx
def test_a_row_has_the_numbers_of_its_run_and_a_burst_is_made_once(tmp_path, monkeypatch, quick_report):
    from burst_fenicsx import run_burst

    bursts, simulate = [], run_burst.simulate
    monkeypatch.setattr(
        "burst_fenicsx.simulate", lambda *asked, **options: bursts.append(1) or simulate(*asked, **options)
    )
    (tmp_path / "short.toml").write_text(RINGS)
    rows = [
        perform({"stage": "row", "of": "run", "threads": 1, "case": one.case})
        for one in plan_sweep(tmp_path / "short.toml", ["flight.drag_factor=1,1.1"]).runs
    ]
    assert [code for code, _ in rows] == [0, 0], rows
    assert len(bursts) == 1
    whole = {"stage": "run", "case_file": str(tmp_path / "short.toml"), "out": str(tmp_path / "run"), "threads": 1}
    assert perform({**whole, "resume": False, "overwrite": False}) == (0, "")
    found, other = (json.loads(message)["results"] for _, message in rows)
    wanted = results_of(RunDirectory(tmp_path / "run").summary())
    # A row flies no realisation where the distance is an integral: it has no band of single events.
    apart = ("wall_seconds", "realisations", "single_event_low", "single_event_high")
    assert {k: v for k, v in found.items() if k not in apart} == {k: v for k, v in wanted.items() if k not in apart}
    assert [found[name] for name in apart[1:]] == [0, None, None]
    assert other["largest_throw"] < found["largest_throw"]


def test_a_sweep_has_a_folder_of_its_own(tmp_path, calls):
    (tmp_path / "case.toml").touch()
    done = invoke("sweep", TUBE, "seed=1,2", "--out", tmp_path)
    assert done.exit_code == 2
    assert f"{tmp_path}: holds a run; a sweep needs a folder of its own" in done.stderr


def test_a_sweep_does_not_run_under_mpirun(tmp_path, calls, monkeypatch):
    monkeypatch.setenv("PMI_SIZE", "2")
    done = invoke("sweep", TUBE, "seed=1,2", "--out", tmp_path / "out")
    assert done.exit_code == 2
    assert "it does not run under mpirun" in done.stderr


@pytest.mark.parametrize(
    ("ends", "code", "message"),
    [
        ({"signal": 9}, -9, "ended by signal 9"),
        ({"exit": 1}, 1, "exit code 1"),
        ({"exit": 4}, 4, "a fault of the program; its traceback is in the run's log"),
        ({"exit": 0}, 4, "a fault of the program; its traceback is in the run's log"),
    ],
)
def test_why_a_run_failed_is_reported_and_the_next_has_a_new_process(ends, code, message):
    runs = LocalRuns(1, 1, answer)
    assert runs.call(ends) == (code, message)
    assert runs.call({})[1] == "1 1"
    runs.close()


def test_a_process_stays_has_its_threads_and_prints_nothing_among_results(capfd):
    runs = LocalRuns(1, 3, answer)
    first, second = runs.call({}), runs.call({})
    runs.close()
    assert first == second
    assert first[1] == "3 3"
    assert first[0] != os.getpid()
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("words") == 2


def test_a_script_is_not_run_again_by_its_processes(tmp_path):
    script = tmp_path / "study.py"
    script.write_text(
        "from fragfield.studies.processes import LocalRuns\n"
        "from tests.fragfield.run_tasks import answer\n"
        "print('begun', flush=True)\n"
        "runs = LocalRuns(2, 1, answer)\n"
        "print(runs.call({})[1])\n"
        "runs.close()\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "begun\n1 1\n"), done.stderr


@pytest.mark.cores
@pytest.mark.parametrize(("jobs", "most"), [(1, 1), (2, 2), (8, 4)])
def test_so_many_runs_go_side_by_side(tmp_path, calls, monkeypatch, jobs, most):
    plain, at_work, seen = LocalRuns.call, [], []
    together = threading.Barrier(most)

    def call(worker, request):
        at_work.append(request)
        together.wait(timeout=60.0)
        seen.append(len(at_work))
        answer = plain(worker, request)
        at_work.remove(request)
        return answer

    monkeypatch.setattr(LocalRuns, "call", call)
    sizes = ",".join(f"{size} mm" for size in (12, 13, 14, 15))
    done = invoke("sweep", TUBE, f"burst.cell_size={sizes}", "--out", tmp_path / "out", "--jobs", jobs, "--json")
    rows = json.loads(done.stdout)["runs"]
    assert [row["state"] for row in rows] == ["done"] * 4
    assert [row["values"]["burst.cell_size"] for row in rows] == sizes.split(",")
    assert max(seen) == most


@pytest.mark.cores
def test_an_interruption_is_passed_on_once_and_waited_for(tmp_path):
    """The workers end in their own time, as bursts that write a checkpoint; no further run is begun."""
    out = tmp_path / "out"
    code = (
        "import signal\nfrom pathlib import Path\nfrom fragfield.studies import processes\n"
        "from fragfield.studies.sweep import SweepOptions, plan_sweep, run_sweep\n"
        "from tests.fragfield.run_tasks import wait_for_interruption\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background processes ignore it
        "processes.LocalRuns.__init__.__defaults__ = (wait_for_interruption,)\n"
        f"plan = plan_sweep(Path({str(TUBE)!r}), ['burst.cell_size=12 mm,15 mm,20 mm'])\n"
        f"run_sweep(plan, SweepOptions(Path({str(out)!r}), jobs=2, keep_runs=True))\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, env=environment)
    begun = [out / f"cell_size_{size}_mm.begun" for size in (12, 15)]
    until = time.monotonic() + 120.0
    while not all(path.is_file() for path in begun):
        assert process.poll() is None
        assert time.monotonic() < until
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    assert "KeyboardInterrupt" in process.communicate(timeout=60)[1]
    assert all(path.with_suffix(".checkpoint").is_file() for path in begun)
    assert not (out / "cell_size_20_mm.begun").exists()
    states = [row["state"] for row in json.loads((out / "sweep.json").read_text())["runs"]]
    assert states == ["waiting"] * 3


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
