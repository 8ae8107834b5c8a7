"""Kernels compiled before the first run: which runs are made, and that a real run then compiles nothing."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from fragfield.case import load_case
from fragfield.case.problem import burst_geometry
from fragfield.pipeline import kernels
from fragfield.studies.workers import Outcome
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
        made.append((burst_geometry(task.case).geometry, task.only, task.directory))
        return Outcome(3, "cell 7 is lost")

    in_threads(monkeypatch, call)
    monkeypatch.setattr(kernels, "_missing", list)
    done = invoke("warm-up", "--json")
    assert done.exit_code == 3
    assert json.loads(done.stdout)["failures"] == ["cell 7 is lost"] * 2
    assert {geometry for geometry, _, _ in made} == {"3d", "axisymmetric"}
    assert sorted(str(only) for _, only, _ in made) == ["None", "None", "burst", "burst"]
    assert not any(out.parent.parent.exists() for _, _, out in made if out)
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


@pytest.mark.parametrize(
    ("missing", "available", "line", "started"),
    [
        (["burst", "flight"], 2, "burst and flight: compiling kernels: once for this version on this machine", True),
        (["burst", "flight"], 1, "burst and flight: compiling kernels", False),
        (["flight"], 2, "flight: compiling kernels", False),
        ([], 2, "", False),
    ],
)
def test_a_first_run_says_what_it_compiles_and_shares_it(monkeypatch, capsys, missing, available, line, started):
    """The second process is waited for where its kernels are needed, and ended where the run ends before."""
    calls = []

    def start(command, **_):
        assert "[burst]" in Path(next(one for one in command if one.endswith("case.toml"))).read_text()
        calls.append(command[4])
        return SimpleNamespace(wait=lambda: calls.append("wait"), terminate=lambda: calls.append("end"))

    monkeypatch.setattr(kernels, "_missing", lambda: missing)
    monkeypatch.setattr(kernels, "cores", lambda: available)
    monkeypatch.setattr(kernels.subprocess, "Popen", start)
    case = load_case(ROOT / "cases" / "tube.toml")
    with kernels.compiled_beside(case, quiet=False) as wait:
        wait()
    assert calls == (["fly", "wait", "end", "wait"] if started else [])
    assert capsys.readouterr().err.startswith(line)
    with kernels.compiled_beside(case, quiet=True):
        pass
    assert capsys.readouterr().err == ""
