"""Processes that make runs, of this machine and of a dask cluster: killed, interrupted, left alone; nothing is lost."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import threading
import time

import pytest

from fragfield.errors import InputError
from fragfield.studies import workers
from fragfield.studies.workers import Cluster, Outcome, Processes, Task, make_all
from fragfield_base.interruption import Interruption
from tests.fragfield.run_tasks import Threads, answer
from tests.fragfield.short_run import RINGS, ROOT, invoke


def task(name, **values):
    return Task(str(name), {}, dict, values)


def made(pool, some):
    found = {}
    make_all(pool, some, lambda one, outcome: found.__setitem__(one.name, outcome))
    return found


@pytest.mark.cores
def test_a_process_stays_has_its_threads_and_prints_nothing_among_results(capfd):
    found = made(Processes(1, 3, answer), [task(1), task(2)])
    assert {outcome.results["threads"] for outcome in found.values()} == {"3"}
    processes = {outcome.results["process"] for outcome in found.values()}
    assert len(processes) == 1
    assert os.getpid() not in processes
    out, err = capfd.readouterr()
    assert out == ""
    assert err.count("words") == 2


@pytest.mark.cores
@pytest.mark.parametrize("ends", [{"signal": 9}, {"exit": 1}])
def test_a_run_that_ends_its_process_has_failed_and_the_study_goes_on(ends):
    some = [task("sound"), task("fatal", **ends), *(task(number) for number in range(4))]
    found = made(Processes(1, 1, answer), some)
    killed = found.pop("fatal")
    assert (killed.code, "--resume makes its runs again" in killed.message) == (4, True)
    assert sorted(found) == ["0", "1", "2", "3", "sound"]
    assert all(outcome.code == 0 for outcome in found.values())


def test_an_error_of_the_caller_interrupts_and_closes():
    seen, pool = [], Threads(1, lambda one: Outcome(0, "", {}))
    pool.interrupt = lambda: seen.append("interrupted")
    pool.close = lambda: seen.append("closed")

    def ended(_task, _outcome):
        raise OSError("disk full")

    with pytest.raises(OSError, match="disk full"):
        make_all(pool, map(task, range(9)), ended)
    assert seen == ["interrupted", "closed"]


@pytest.mark.cores
def test_a_script_is_not_run_again_by_its_processes(tmp_path):
    script = tmp_path / "study.py"
    script.write_text(
        "from fragfield.studies.workers import Processes, Task, make_all\n"
        "from tests.fragfield.run_tasks import answer\n"
        "print('begun', flush=True)\n"
        "make_all(Processes(2, 1, answer), [Task('a', {}, dict)], lambda one, end: print(one.name, end.code))\n"
    )
    done = subprocess.run(
        [sys.executable, str(script)], capture_output=True, text=True, check=False,
        env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    assert (done.returncode, done.stdout) == (0, "begun\na 0\n"), done.stderr


@pytest.mark.cores
@pytest.mark.parametrize("ends", ["killed", "interrupted"])
def test_runs_end_with_their_checkpoints_when_the_study_does(tmp_path, ends):
    """In their own time, as bursts that write a checkpoint; no further run is begun."""
    code = (
        "import signal\nfrom pathlib import Path\nfrom fragfield.studies.workers import Processes, Task, make_all\n"
        "from tests.fragfield.run_tasks import wait_for_interruption\n"
        "signal.signal(signal.SIGINT, signal.default_int_handler)\n"  # a shell's background processes ignore it
        f"some = [Task(name, {{}}, dict, directory=Path({str(tmp_path)!r}) / name) for name in 'abc']\n"
        "make_all(Processes(2, 1, wait_for_interruption), some, print)\n"
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    process = subprocess.Popen([sys.executable, "-c", code], stderr=subprocess.PIPE, text=True, env=environment)
    until = time.monotonic() + 120.0
    while not all((tmp_path / f"{name}.begun").is_file() for name in "ab"):
        assert process.poll() is None, process.stderr.read()
        assert time.monotonic() < until
        time.sleep(0.05)
    if ends == "killed":
        process.kill()
    else:
        process.send_signal(signal.SIGINT)
        assert "KeyboardInterrupt" in process.communicate(timeout=60)[1]
    while not all((tmp_path / f"{name}.checkpoint").is_file() for name in "ab"):
        assert time.monotonic() < until
        time.sleep(0.05)
    process.communicate(timeout=60)
    assert not (tmp_path / "c.begun").exists()


# --- dask


@pytest.fixture
def cluster(monkeypatch):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setenv("PYTHONPATH", str(ROOT))
    with distributed.LocalCluster(
        n_workers=2, threads_per_worker=1, processes=True, dashboard_address=None, memory_limit=0, silence_logs=50
    ) as found:
        yield found


def _noting(folder, waits_for="", slow=None):
    """A run that leaves its name and process, and answers; the slow one, or from the third on, once a file is there."""

    def perform_in_turn(one, _study, _build):
        import os
        import time
        from pathlib import Path

        from fragfield.studies.workers import Outcome

        (Path(folder) / f"{one.name}-{os.getpid()}-{time.monotonic_ns()}").touch()
        until = time.monotonic() + 60.0
        waits = int(one.name) > 2 if slow is None else int(one.name) == slow
        while waits_for and waits and not Path(waits_for).exists() and time.monotonic() < until:
            time.sleep(0.02)
        return Outcome(0, f"answer {one.name}", {})

    return perform_in_turn


def test_a_worker_of_a_cluster_that_is_killed_loses_nothing(cluster, tmp_path, monkeypatch):
    folder, go_on = tmp_path / "begun", tmp_path / "go_on"
    folder.mkdir()
    monkeypatch.setattr(workers, "perform_in_turn", _noting(str(folder), str(go_on)))
    killed = []

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
    pool = Cluster(cluster.scheduler_address, None, 100)
    assert pool.size == 2
    found = made(pool, [task(number) for number in range(12)])
    assert {name: outcome.message for name, outcome in found.items()} == {str(n): f"answer {n}" for n in range(12)}
    thread.join()
    begun = [int(path.name.split("-")[0]) for path in folder.iterdir()]
    assert begun.count(killed[0]) == 2  # the run of the killed worker was begun again, no other one
    assert len(begun) == 13


def test_a_slow_worker_holds_one_run_and_no_other(cluster, tmp_path, monkeypatch):
    """Its run ends only after all others have."""
    waiting, folder = tmp_path / "others_are_done", tmp_path / "begun"
    folder.mkdir()
    monkeypatch.setattr(workers, "perform_in_turn", _noting(str(folder), str(waiting), slow=3))
    found = {}

    def ended(one, outcome):
        found[one.name] = outcome.message
        if len(found) == 11:
            assert "3" not in found
            waiting.touch()

    make_all(Cluster(cluster.scheduler_address, None, 100), map(task, range(12)), ended)
    assert found == {str(number): f"answer {number}" for number in range(12)}


def test_a_worker_of_another_version_is_refused(cluster, monkeypatch):
    with monkeypatch.context() as patch:
        patch.setattr(workers, "__version__", "9.9.9")
        with pytest.raises(
            InputError, match=r"found the worker tcp://\S+ with fragfield \d\S+.*; allowed: fragfield 9\.9\.9"
        ):
            Cluster(cluster.scheduler_address, None, 4)
    late = workers.perform_in_turn(task(1), "a study", "fragfield 9.9.9")
    assert (late.code, late.results) == (2, None)
    assert "allowed: fragfield 9.9.9, as the study has" in late.message


def test_an_interruption_reaches_the_cluster(cluster, monkeypatch, tmp_path):
    monkeypatch.setattr(workers, "perform_in_turn", _noting(str(tmp_path)))

    def ended(_task, _outcome):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        make_all(Cluster(cluster.scheduler_address, 1, 100), map(task, range(50)), ended)
    assert len(list(tmp_path.iterdir())) < 5


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:1", "nowhere://x"])
def test_a_scheduler_that_does_not_answer(address, monkeypatch, tmp_path):
    pytest.importorskip("distributed")
    monkeypatch.setattr(workers, "_ANSWER", 1.0)
    words = ["sweep", ROOT / "cases" / "tube.toml", "seed=1,2", "--out", tmp_path / "out"]
    done = invoke(*words, "--scheduler", address)
    assert done.exit_code == 2, done.output
    assert f"--scheduler: found '{address}': no dask scheduler answers there" in done.stderr


def test_a_scheduler_without_workers():
    distributed = pytest.importorskip("distributed")
    with (
        distributed.LocalCluster(n_workers=0, dashboard_address=None, silence_logs=50) as empty,
        pytest.raises(InputError, match="it has no workers; start `dask worker tcp://"),
    ):
        Cluster(empty.scheduler_address, None, 4)


def test_an_interrupted_study_ends_its_runs_and_the_next_one_begins(monkeypatch):
    monkeypatch.setattr(workers, "perform", lambda _task: Outcome(0, str(workers.end_requested.is_set())))
    build = workers.build_here()
    assert workers.perform_in_turn(task(1), "first", build).message == "False"
    workers.end_here("first")
    with Interruption() as interruption:
        assert interruption.asked()
    assert workers.perform_in_turn(task(1), "first", build).code == 130
    assert workers.perform_in_turn(task(1), "second", build).message == "False"


@pytest.mark.slow
@pytest.mark.dolfinx
def test_a_real_sweep_on_a_cluster_of_which_one_worker_is_killed(cluster, tmp_path):
    import json

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
    words = ["sweep", case, "burst.leakage.radius_ratio=1.6,1.7,1.8,1.9", "seed=1,2", "--out", out, "--json"]
    done = invoke(*words, "--keep-runs", "--scheduler", cluster.scheduler_address)
    thread.join()
    assert killed
    assert done.exit_code in (0, 3), done.output
    rows = json.loads(done.stdout)["runs"]
    assert [row["state"] for row in rows] == ["done"] * 8, [row["message"] for row in rows]
    speeds = [row["results"]["mean_initial_speed"] for row in rows]
    assert speeds[::2] == speeds[1::2]  # the seed changes nothing in the burst
    here = invoke(*words[:3], "seed=1", "--out", tmp_path / "here", "--json", "--jobs", "1")
    assert [row["results"]["mean_initial_speed"] for row in json.loads(here.stdout)["runs"]] == speeds[::2]
