"""Figures drawn by two processes: the same bytes as by one, whatever becomes of the helper."""

from __future__ import annotations

import os
import shutil

import pytest

from fragfield.errors import InputError
from fragfield.report.figures import burst as burst_figures
from fragfield.report.figures import early, side_by_side
from fragfield.report.figures import hazard as hazard_figures
from fragfield.report.figures.early import draw_early, early_figures
from fragfield.report.figures.side_by_side import FigureQueue
from fragfield.report.reading.run_files import read_run
from tests.fragfield.synthetic_run import write_run

pytestmark = pytest.mark.cores

DRAWINGS = {
    "speed_along_round": burst_figures.speed_along_round,
    "casing_over_time": burst_figures.casing_over_time,
    "landing_map": hazard_figures.landing_map,
}


def nothing(_run):
    """A figure without data."""
    return


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return read_run(write_run(tmp_path_factory.mktemp("side") / "run", rounds=1))


@pytest.fixture(scope="module")
def alone(run):
    figures = FigureQueue(run, helped=False)
    for name, function in DRAWINGS.items():
        figures.add(name, function)
    figures.add("nothing", nothing)
    found = figures.finish()
    assert found["nothing"] is None
    assert found["speed_along_round"]["png"].startswith(b"\x89PNG")
    return found


@pytest.mark.cores
@pytest.mark.skipif(len(os.sched_getaffinity(0)) < 2, reason="a helper needs its own core")
def test_a_helper_draws_the_same_bytes(run, alone):
    figures = FigureQueue(run, helped=True, fewest=1)
    for name, function in DRAWINGS.items():
        figures.add(name, function)
    figures._thread.join(timeout=0.0)
    while len(figures._drawn) < len(DRAWINGS):  # all of them by the helper, before this process takes any
        assert figures._thread.is_alive()
        figures._thread.join(timeout=0.05)
    assert figures.finish() == {name: alone[name] for name in DRAWINGS}
    figures.close()


def test_a_helper_is_not_started_for_a_few_figures(run, alone, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    figures = FigureQueue(run, helped=True)
    for name, function in DRAWINGS.items():
        figures.add(name, function)
    assert figures._thread is None
    assert figures.finish() == {name: alone[name] for name in DRAWINGS}
    assert figures._process is None
    started = []
    monkeypatch.setattr(FigureQueue, "_start", lambda self: started.append(len(self._waiting)))
    for number in range(side_by_side._FEWEST):
        figures.add(f"figure {number}", nothing)
    assert started == [side_by_side._FEWEST]
    figures.close()


@pytest.mark.parametrize(
    "helper",
    [
        "raise SystemExit(1)",
        "print('ready', flush=True); input(); raise SystemExit(1)",
        "print('ready', flush=True); input(); print('no answer', flush=True)",
    ],
)
def test_without_its_helper_a_report_is_whole(run, alone, monkeypatch, helper):
    monkeypatch.setattr(side_by_side, "_SERVE", helper)
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    figures = FigureQueue(run, helped=True, fewest=1)
    for name, function in DRAWINGS.items():
        figures.add(name, function)
    assert figures.finish() == {name: alone[name] for name in DRAWINGS}
    figures.close()


def test_an_error_of_the_report_ends_the_helper(run, monkeypatch):
    monkeypatch.setattr(side_by_side, "_SERVE", "print('ready', flush=True); input(); import time; time.sleep(600)")
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    figures = FigureQueue(run, helped=True, fewest=1)
    figures.add("speed_along_round", DRAWINGS["speed_along_round"])
    thread = figures._thread
    while figures._waiting or figures._process is None:
        thread.join(timeout=0.05)
    figures.close()
    thread.join(timeout=30.0)
    assert not thread.is_alive()
    assert figures._process.returncode is not None


_DIES = "import sys; print('ready', flush=True); input(); sys.stderr.write('no driver\\n'); sys.stderr.flush(); import os; os.kill(os.getpid(), 11)"  # noqa: E501


def test_where_vtk_ends_the_helper_the_report_goes_on_and_says_so(run, alone, monkeypatch, tmp_path):
    monkeypatch.setattr(side_by_side, "_SERVE", _DIES)
    figures = FigureQueue(run, helped=False)
    figures.add("speed_along_round", DRAWINGS["speed_along_round"])
    figures.add_picture("picture_of_burst", tmp_path)
    figures.add_picture("picture_of_fragments", tmp_path)
    assert figures.finish() == {"speed_along_round": alone["speed_along_round"]}
    for name in ("picture_of_burst", "picture_of_fragments"):
        assert "VTK fails to draw without a window here (no driver); install" in figures.picture(name)["missing"]
    figures.close()


@pytest.mark.parametrize(
    ("answer", "kind", "words"),
    [
        ('{"input": "burst.h5: damaged"}', InputError, "burst.h5: damaged"),
        ('{"fault": "line 3"}', RuntimeError, "line 3"),
    ],
)
def test_an_error_of_a_picture_is_raised_here(run, monkeypatch, tmp_path, answer, kind, words):
    monkeypatch.setattr(side_by_side, "_SERVE", f"print('ready', flush=True); input(); print('{answer}', flush=True)")
    figures = FigureQueue(run, helped=False)
    figures.add_picture("picture_of_burst", tmp_path)
    figures.finish()
    with pytest.raises(kind, match=words):
        figures.picture("picture_of_burst")
    figures.close()


def test_figures_begun_early_are_those_of_the_whole_run(run, alone, tmp_path, monkeypatch):
    """Begun from the files of the burst, gone on with those of all stages; nothing is drawn twice."""
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    folder = tmp_path / "run"
    write_run(folder, rounds=1, stages=1)
    figures = early_figures(folder)
    monkeypatch.setattr(
        early, "EARLY", {"burst": ("picture_of_burst", {"speed_along_round": DRAWINGS["speed_along_round"]})}
    )
    monkeypatch.setattr(early, "library_fault", lambda: "none here")
    draw_early(figures, folder, "fly")
    assert not figures._known
    draw_early(figures, folder, "burst")
    while "speed_along_round" not in figures._drawn:
        assert figures._thread.is_alive()
        figures._thread.join(timeout=0.05)
    shutil.rmtree(folder)
    shutil.copytree(run.folder, folder)
    figures.renew(read_run(folder))
    for name, function in DRAWINGS.items():
        figures.add(name, function)
    assert figures.finish() == {name: alone[name] for name in DRAWINGS}
    figures.close()


def test_on_one_core_nothing_is_begun_early(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    assert early_figures(tmp_path) is None
