"""Kernels compiled before the first run: which runs are made, and that a real run then compiles nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from fragfield.case.problem import burst_geometry
from fragfield.studies.tasks import Outcome
from tests import kernel_caches
from tests.fragfield.run_tasks import in_threads
from tests.fragfield.short_run import invoke

ROOT = Path(__file__).parents[2]
COMPILED = """
import sys
from fragfield.cli import main
from numba.core import event
found = []
class Watch(event.Listener):
    def on_start(self, happened):
        found.append(str(happened.data["dispatcher"]))
    def on_end(self, happened):
        pass
event.register("numba:compile", Watch())
try:
    main()
except SystemExit as ended:
    assert not ended.code
sys.stdout.write("compiled: " + ", ".join(found))
"""


def test_a_meridian_and_a_pair_in_three_dimensions_are_computed_and_leave_nothing(monkeypatch):
    made = []

    def call(task):
        made.append((burst_geometry(task.case).geometry, task.directory))
        return Outcome(3, "cell 7 is lost")

    in_threads(monkeypatch, call)
    done = invoke("warm-up", "--json")
    assert done.exit_code == 3
    assert json.loads(done.stdout)["failures"] == ["cell 7 is lost"] * 2
    assert sorted(geometry for geometry, _ in made) == ["3d", "axisymmetric"]
    assert not any(out.parent.parent.exists() for _, out in made)
    assert "a run failed: cell 7 is lost" in invoke("warm-up").stdout


@pytest.mark.slow
@pytest.mark.dolfinx
def test_a_run_after_it_compiles_nothing(tmp_path):
    variables = {**os.environ, "PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "cache")}

    def run(*command):
        done = subprocess.run(
            [sys.executable, *command], env=variables, capture_output=True, text=True, check=False, cwd=tmp_path
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert tmp_path / json.loads(run("-m", "fragfield", "warm-up", "--json"))["cache"] == tmp_path / "cache"
    options = ("--out", tmp_path / "out", "--set", "burst.cell_size=12 mm", "--set", "burst.end_time=30 us", "--quiet")
    assert run("-c", COMPILED, "run", ROOT / "cases" / "m107_tnt.toml", *options).rpartition("compiled: ")[2] == ""


def test_the_tests_share_the_kernels_of_today():
    """What `tests/kernel_caches.py` takes over and links are the cache folders that the kernels name now."""
    states = {name.partition("/")[0] for name in kernel_caches.folders()}
    assert sorted(state.partition("-")[0] for state in states) == ["burst", "flight", "transition"]
