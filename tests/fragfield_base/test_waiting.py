"""Threads that wait are asleep: the setting is there before OpenMP's library is, and a user's own setting stays."""

from __future__ import annotations

import ctypes.util
import os
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

from fragfield_base import cores
from tests.fragfield.short_run import ROOT

NAMES = ("OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME")


def _printed(code, **variables):
    environment = {name: value for name, value in os.environ.items() if name not in NAMES}
    environment |= {"PYTHONPATH": str(ROOT), **variables}
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(code)], capture_output=True, text=True, env=environment, check=True
    )


@pytest.fixture
def idle(monkeypatch):
    """A machine of eight cores on which nothing else runs, and no variable about threads."""
    for name in (*NAMES, "NUMBA_NUM_THREADS", "OMP_NUM_THREADS", "OMPI_COMM_WORLD_LOCAL_SIZE"):
        monkeypatch.delenv(name, raising=False)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: set(range(8)))
    monkeypatch.setattr(os, "cpu_count", lambda: 8)
    monkeypatch.setattr(cores, "_others_running", lambda: 0)
    return monkeypatch


@pytest.mark.parametrize(
    ("variables", "others", "policy"),
    [
        ({}, 0, None),
        ({}, 1, "passive"),
        ({"NUMBA_NUM_THREADS": "2"}, 6, None),
        ({"NUMBA_NUM_THREADS": "2"}, 7, "passive"),
        ({"OMP_NUM_THREADS": "2", "OMPI_COMM_WORLD_LOCAL_SIZE": "4"}, 0, None),
        ({"OMP_NUM_THREADS": "2", "OMPI_COMM_WORLD_LOCAL_SIZE": "4"}, 3, None),  # the other ranks
        ({"OMP_NUM_THREADS": "2", "OMPI_COMM_WORLD_LOCAL_SIZE": "4"}, 4, "passive"),
        ({"OMP_NUM_THREADS": "2", "OMPI_COMM_WORLD_LOCAL_SIZE": "5"}, 0, "passive"),
        ({"OMP_WAIT_POLICY": "active"}, 20, "active"),
        ({"GOMP_SPINCOUNT": "1000"}, 20, None),
    ],
)
def test_threads_sleep_where_there_are_more_than_free_cores(idle, variables, others, policy):
    for name, value in variables.items():
        idle.setenv(name, value)
    idle.setattr(cores, "_others_running", lambda: others)
    cores.let_threads_sleep()
    assert os.environ.get("OMP_WAIT_POLICY") == policy


@pytest.mark.parametrize(("threads", "policy"), [("2", None), ("3", "passive")])
def test_ranks_that_are_bound_to_cores_have_those_alone(idle, threads, policy):
    idle.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    idle.setattr(cores, "_others_running", lambda: 20)
    idle.setenv("OMPI_COMM_WORLD_LOCAL_SIZE", "4")
    idle.setenv("NUMBA_NUM_THREADS", threads)
    cores.let_threads_sleep()
    assert os.environ.get("OMP_WAIT_POLICY") == policy


def test_what_else_runs_is_seen_at_once_and_no_longer(idle):
    """The mean of a minute says nothing of work that has just begun, and still counts what has ended."""
    idle.undo()
    idle.setattr(os, "getloadavg", lambda: (50.0, 50.0, 50.0))
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(3)]
    try:
        assert 3 <= max(cores._others_running() for _ in range(20)) < 50
    finally:
        for process in busy:
            process.kill()
            process.wait()


def test_without_a_count_of_running_threads_it_is_the_load(idle):
    idle.undo()
    idle.setattr(os, "getloadavg", lambda: (5.6, 0.0, 0.0))
    idle.setattr(Path, "read_text", lambda *_, **__: "nothing of the kind")
    assert cores._others_running() == 6


@pytest.mark.parametrize(
    ("package", "policy"),
    [
        ("fragfield", "None"),
        ("flight.kernels.compiling", "passive"),
        ("transition.kernels", "passive"),
        ("burst_fenicsx.kernels.lanes", "passive"),
    ],
)
def test_kernels_settle_it_and_the_import_of_the_program_does_not(package, policy):
    code = f"""
        import os
        os.sched_getaffinity = lambda _: set()
        import {package}
        print(os.environ.get("OMP_WAIT_POLICY"))
    """
    assert _printed(code, NUMBA_NUM_THREADS="1").stdout.strip() == policy


@pytest.mark.skipif(ctypes.util.find_library("gomp") is None, reason="there is no libgomp")
def test_the_library_takes_it():
    """What libgomp itself says that it has read, in a process that uses a shared loop of ours."""
    code = """
        import os
        cores = os.sched_getaffinity
        os.sched_getaffinity = lambda _: set()
        import fragfield_base.kernel_cache
        os.sched_getaffinity = cores
        import numba
        @numba.njit(parallel=True)
        def add(values):
            for k in numba.prange(values.size):
                values[k] += 1.0
        import numpy
        add(numpy.zeros(8))
        print(numba.threading_layer())
    """
    done = _printed(code, OMP_DISPLAY_ENV="TRUE", NUMBA_THREADING_LAYER="omp", NUMBA_NUM_THREADS="2")
    assert done.stdout.strip() == "omp"
    assert "OMP_WAIT_POLICY = 'PASSIVE'" in done.stderr
