"""Runs on a dask cluster of two workers, of which one is killed in the middle: nothing is lost."""

from __future__ import annotations

import json
import os
import signal
import threading
import time
from pathlib import Path
from types import SimpleNamespace

import pytest
from typer.testing import CliRunner

import fragfield.studies.cluster as cluster_module
from fragfield.cli import app
from fragfield.errors import InputError
from fragfield.studies.cluster import ClusterRuns
from fragfield.studies.runner import make_all
from fragfield_base.interruption import Interruption
from fragfield_base.writing import locked
from tests.fragfield.short_run import RINGS

distributed = pytest.importorskip("distributed")
ROOT = Path(__file__).parents[2]


@pytest.fixture
def cluster(monkeypatch):
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0, silence_logs=50
    ) as found:
        yield found


def _noting(folder, waits_for=""):
    """A run that leaves its number and process, and answers; from the fourth on once a file is there."""

    def run_here(request, _study):
        import os
        import time
        from pathlib import Path

        place = Path(folder) / f"{request['number']}-{os.getpid()}-{time.monotonic_ns()}"
        place.touch()
        until = time.monotonic() + 60.0
        while waits_for and request["number"] > 2 and not Path(waits_for).exists() and time.monotonic() < until:
            time.sleep(0.02)
        return 0, f"answer {request['number']}"

    return run_here


def test_a_worker_that_is_killed_loses_nothing(cluster, tmp_path, monkeypatch):
    folder, go_on = tmp_path / "begun", tmp_path / "go_on"
    folder.mkdir()
    monkeypatch.setattr(cluster_module, "run_here", _noting(str(folder), str(go_on)))
    found, killed = {}, []

    def kill():
        """The process of a run that waits."""
        while not killed:
            for path in folder.iterdir():
                number, process, _ = map(int, path.name.split("-"))
                if number > 2:
                    killed.append(number)
                    os.kill(process, signal.SIGKILL)
                    go_on.touch()
                    return
            time.sleep(0.01)

    thread = threading.Thread(target=kill, daemon=True)
    thread.start()
    runs = ClusterRuns(cluster.scheduler_address, 1, None, 100)
    assert runs.size == 2
    make_all(runs, range(12), lambda number: runs.call({"number": number}), found.__setitem__)
    assert found == {number: (0, f"answer {number}") for number in range(12)}
    thread.join()
    begun = [int(path.name.split("-")[0]) for path in folder.iterdir()]
    assert begun.count(killed[0]) == 2  # the run of the killed worker was begun again, no other one
    assert len(begun) == 13


def test_an_interruption_reaches_the_cluster(cluster, monkeypatch, tmp_path):
    monkeypatch.setattr(cluster_module, "run_here", _noting(str(tmp_path)))
    runs = ClusterRuns(cluster.scheduler_address, 1, 1, 100)

    def ended(_number, _outcome):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_all(runs, range(50), lambda number: runs.call({"number": number}), ended)
    assert len(list(tmp_path.iterdir())) < 5


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nowhere://x"])
def test_a_scheduler_that_does_not_answer(address, monkeypatch, tmp_path):
    monkeypatch.setattr(cluster_module, "_ANSWER", 1.0)
    words = ["sweep", str(ROOT / "cases" / "tube.toml"), "seed=1,2", "--out", str(tmp_path / "out")]
    done = CliRunner().invoke(app, [*words, "--scheduler", address])
    assert done.exit_code == 2, done.output
    assert f"--scheduler: found '{address}': no dask scheduler answers there" in done.stderr


def test_a_scheduler_without_workers():
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=None, silence_logs=50) as empty,
        pytest.raises(InputError, match="it has no workers; start `dask worker tcp://"),
    ):
        ClusterRuns(empty.scheduler_address, 1, None, 4)


def test_a_run_waits_for_the_process_of_a_lost_worker(tmp_path, monkeypatch):
    """It holds the run directory until it has written its checkpoint."""
    held, looked, ending = threading.Event(), threading.Event(), threading.Event()
    monkeypatch.setattr(cluster_module, "time", SimpleNamespace(monotonic=time.monotonic, sleep=lambda _: looked.set()))

    def hold():
        with locked(tmp_path, InputError):
            held.set()
            looked.wait()
            ending.set()

    thread = threading.Thread(target=hold)
    thread.start()
    held.wait()
    cluster_module._await_lock({"out": str(tmp_path), "patience": 300.0})
    assert ending.is_set()
    thread.join()
    looked.clear()
    cluster_module._await_lock({"stage": "sample"})
    assert not looked.is_set()


def test_an_interrupted_study_ends_its_runs_and_the_next_one_begins(monkeypatch):
    monkeypatch.setattr(cluster_module, "perform", lambda request: (0, str(cluster_module.end_requested.is_set())))
    assert cluster_module.run_here({"stage": "sample"}, "first") == (0, "False")
    cluster_module.end_here("first")
    with Interruption() as interruption:
        assert interruption.asked()
    assert cluster_module.run_here({"stage": "sample"}, "first") == (130, "interrupted")
    assert cluster_module.run_here({"stage": "sample"}, "second") == (0, "False")


@pytest.mark.slow
@pytest.mark.dolfinx
def test_a_real_sweep_on_a_cluster_of_which_one_worker_is_killed(cluster, tmp_path):
    case, out = tmp_path / "short.toml", tmp_path / "out"
    case.write_text(RINGS)
    killed = []

    def kill():
        until = time.monotonic() + 300.0
        while time.monotonic() < until and not list(out.glob("*/burst_snapshot.h5")):
            time.sleep(0.1)
        killed.append(next(iter(cluster.workers.values())).pid)
        os.kill(killed[0], signal.SIGKILL)

    thread = threading.Thread(target=kill)
    thread.start()
    words = ["sweep", str(case), "burst.leakage.radius_ratio=1.6,1.7,1.8,1.9", "seed=1,2", "--out", str(out), "--json"]
    done = CliRunner().invoke(app, [*words, "--keep-runs", "--scheduler", cluster.scheduler_address])
    thread.join()
    assert killed
    assert done.exit_code in (0, 3), done.output
    rows = json.loads(done.stdout)["runs"]
    assert [row["state"] for row in rows] == ["done"] * 8, [row["message"] for row in rows]
    speeds = [row["results"]["mean_initial_speed"] for row in rows]
    assert speeds[::2] == speeds[1::2]  # the seed changes nothing in the burst
    here = CliRunner().invoke(app, [*words[:3], "seed=1", "--out", str(tmp_path / "here"), "--json", "--jobs", "1"])
    assert [row["results"]["mean_initial_speed"] for row in json.loads(here.stdout)["runs"]] == speeds[::2]
