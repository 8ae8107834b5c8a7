"""Kernels compiled before a run, side by side: what is listed is found, what is compiled is not compiled again."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from pathlib import Path

import numba
import pytest

from fragfield import compile_ahead as ahead
from fragfield.compile_ahead import FOLDER, compile_ahead, list_of, merged
from fragfield.terminal.progress import ProgressReporter
from fragfield_base import kernel_cache, kernel_workers
from fragfield_base.kernel_lists import as_text, as_type, find_kernel
from fragfield_base.kernel_workers import compile_side_by_side

ROOT = Path(__file__).parents[2]
LISTS = sorted(FOLDER.glob("*.json"))
COMPILED = """
import json, sys
from numba.core import event
from fragfield_base.kernel_lists import as_type, find_kernel
for kernel in json.load(sys.stdin):
    with event.install_recorder("numba:compile") as recorder:
        for arguments in kernel["arguments"]:
            find_kernel(kernel["kernel"]).compile(tuple(as_type(text) for text in arguments))
    print(len(recorder.buffer))
"""


@pytest.fixture
def empty_cache(tmp_path, monkeypatch):
    """A cache folder with nothing in it, for this process and its children."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    kernel_cache.cache_root.cache_clear()
    assert kernel_cache.cache_root() == tmp_path / "cache"
    yield tmp_path / "cache"
    kernel_cache.cache_root.cache_clear()


def _quick(number: int) -> list[dict]:
    """The kernels of the burst that compile fastest."""
    return sorted(json.loads(list_of("burst", "3d").read_text()), key=lambda kernel: kernel["seconds"])[:number]


@pytest.mark.parametrize("path", LISTS, ids=lambda path: path.stem)
def test_lists_name_kernels_and_types_that_there_are(path):
    for kernel in json.loads(path.read_text()):
        found = find_kernel(kernel["kernel"])
        assert isinstance(found, numba.core.dispatcher.Dispatcher), kernel["kernel"]
        for arguments in kernel["arguments"]:
            assert len(arguments) == len(numba.core.utils.pysignature(found.py_func).parameters)
            assert [as_text(as_type(text)) for text in arguments] == arguments


def test_every_stage_of_a_default_run_has_its_list():
    wanted = {list_of(stage, geometry) for stage in ("burst", "break-up", "fly") for geometry in ("3d", "axisymmetric")}
    assert wanted == set(LISTS)


def test_what_processes_compile_is_found_by_the_next_one(empty_cache):
    kernels, shown = _quick(3), []
    assert compile_side_by_side(kernels, 2, shown.append) == 3
    assert shown == [1, 2, 3]
    done = subprocess.run(
        [sys.executable, "-c", COMPILED],
        input=json.dumps(kernels),
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert done.stdout.split() == ["0", "0", "0"]


def test_kernels_and_processes_that_fail_are_survived(empty_cache, tmp_path, monkeypatch):
    (tmp_path / "ends_its_process.py").write_text("import os\nos._exit(9)\n")
    monkeypatch.syspath_prepend(tmp_path)
    broken = [
        {"kernel": "ends_its_process.kernel", "arguments": [], "seconds": 99.0},
        {"kernel": "burst_fenicsx.kernels.vectors.rows.no_such_kernel", "arguments": [["float64"]], "seconds": 98.0},
        {"kernel": "no_such_package.kernels.kernel", "arguments": [], "seconds": 97.0},
    ]
    shown = []
    assert compile_side_by_side([*broken, *_quick(1)], 2, shown.append) == 1
    assert shown == [1, 2, 3, 4]


def test_nothing_is_compiled_where_no_process_can_be_started(monkeypatch):
    monkeypatch.setattr(kernel_workers.sys, "executable", "/nowhere/python")
    assert compile_side_by_side(_quick(2), 2, lambda _: None) == 0


def test_an_interruption_ends_the_processes(monkeypatch):
    started = []
    start = kernel_workers._start
    monkeypatch.setattr(kernel_workers, "_start", lambda: started.append(start()) or started[-1])

    def interrupt(_):
        raise KeyboardInterrupt

    missing = [{"kernel": f"no_such_package.k{n}", "arguments": [], "seconds": 1.0} for n in range(3)]
    with pytest.raises(KeyboardInterrupt):
        compile_side_by_side(missing, 2, interrupt)
    assert [worker.returncode for worker in started] == [-signal.SIGKILL] * 2


@pytest.fixture
def counted(monkeypatch):
    """Lists of one kernel, and how often each set is given to processes, which do nothing."""
    given = []

    def instead(kernels, cores, done):
        given.append([kernel["kernel"] for kernel in kernels])
        done(len(kernels))
        return len(kernels)

    monkeypatch.setattr(ahead, "compile_side_by_side", instead)
    return given


def test_a_list_is_compiled_once_for_its_text_and_the_kernels_sources(empty_cache, counted, tmp_path):
    path = tmp_path / "list.json"
    path.write_text(json.dumps(_quick(1)))
    shown = []
    assert compile_ahead([path], 2, lambda *numbers: shown.append(numbers)) == 1
    assert shown == [(0, 1), (1, 1)]
    assert compile_ahead([path, tmp_path / "missing.json"], 2, lambda *_: pytest.fail("nothing is to be done")) == 0
    path.write_text(json.dumps(_quick(2)))
    assert compile_ahead([path], 2, lambda *_: None) == 2
    assert len(counted) == 2


def test_kernels_of_another_checkout_are_compiled_there(monkeypatch, tmp_path):
    """Numba finds what it has kept by path and time of the source; the same text elsewhere, or touched, is another."""
    keys = []
    for name, time in (("one", 1), ("two", 1), ("two", 2), ("one", 1)):
        source = tmp_path / name / "kernel.py"
        source.parent.mkdir(exist_ok=True)
        source.write_text("x = 1\n")
        os.utime(source, (time, time))
        monkeypatch.setattr(ahead, "_folder_of", lambda *_, folder=source.parent: folder)
        keys.append(ahead._key(json.dumps(_quick(1))))
    assert keys[0] == keys[3]
    assert len(set(keys)) == 3


def test_a_list_of_which_a_kernel_failed_is_tried_again(empty_cache, monkeypatch):
    monkeypatch.setattr(ahead, "compile_side_by_side", lambda kernels, cores, done: len(kernels) - 1)
    for _ in range(2):
        assert compile_ahead([list_of("fly", "3d")], 2, lambda *_: None) > 0


def test_without_a_cache_nothing_is_compiled_ahead(monkeypatch, counted):
    monkeypatch.setattr(ahead, "cache_root", lambda: None)
    assert compile_ahead([list_of("fly", "3d")], 2, lambda *_: None) == 0
    assert not counted


def test_one_command_compiles_and_the_others_wait(empty_cache, counted):
    """A second one finds the lock taken, says so, and has nothing to do afterwards."""
    with ahead._alone(empty_cache / "compiled", lambda: None):
        script = (
            "from fragfield.compile_ahead import *\n"
            "compile_ahead([list_of('fly', '3d')], 1, lambda done, total: print(done, total, flush=True))"
        )
        other = subprocess.Popen([sys.executable, "-c", script], stdout=subprocess.PIPE, text=True, cwd=ROOT)
        assert other.stdout.readline() == "0 0\n"
        (empty_cache / "compiled" / ahead._key(list_of("fly", "3d").read_text())).touch()
    assert set(other.communicate(timeout=60)[0].split("\n")) <= {"0 0", ""}
    assert other.returncode == 0


def test_one_kernel_of_several_lists_is_given_to_one_process():
    first = {"kernel": "a.b", "arguments": [["float64"]], "seconds": 1.0}
    second = {"kernel": "a.b", "arguments": [["float64"], ["int64"]], "seconds": 2.0}
    [found] = merged([json.dumps([first]), json.dumps([second])])
    assert found["arguments"] == [["float64"], ["int64"]]


def test_progress_counts_the_kernels():
    found = []
    with ProgressReporter(enabled=False, follow=found.append) as reporter:
        reporter.kernels(0, 0)
        reporter.kernels(12, 40)
        reporter.stage("burst")
    assert [one.stage for one in found[:3]] == ["kernels"] * 3
    assert found[2].share == 0.3
    assert found[2].detail.startswith("compiling kernels, 12 of 40: once")


def test_the_step_of_one_point_compiles_no_kernel_of_the_full_quadrature(monkeypatch):
    from burst_fenicsx.kernels.step import assembly

    calls = {name: numba.njit(lambda *_: None) for name in ("_advance_solid", "_advance_solid_full", "_advance_charge")}
    for name, stand_in in calls.items():
        monkeypatch.setattr(assembly, name, stand_in)
    [step] = [one for one in json.loads(list_of("burst", "3d").read_text()) if one["kernel"].endswith("element_forces")]
    _, seconds, now, level, _, nodes, _, _, grid, *others, _ = (as_type(text) for text in step["arguments"][0])
    for points, left_out in ((assembly.ONE_POINT, "_advance_solid_full"), (assembly.FULL_QUADRATURE, "_advance_solid")):
        chunk = numba.njit(error_model="numpy")(assembly._run_chunk.py_func)
        kinds = [seconds, now, level, numba.typeof(points), nodes, grid, *others, numba.float64[::1]]
        chunk.compile((numba.int64, *kinds))
        assert not calls[left_out].signatures
        assert calls["_advance_charge"].signatures
        calls["_advance_solid" if left_out == "_advance_solid_full" else "_advance_solid_full"]._reset_overloads()
