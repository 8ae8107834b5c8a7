"""Figures drawn here and pictures in a process of its own, whatever becomes of it; pictures begun early."""

from __future__ import annotations

import os

import pytest

from fragfield.errors import InputError
from fragfield.report.figures import burst as burst_figures
from fragfield.report.figures import early, side_by_side
from fragfield.report.figures.early import draw_early, early_figures
from fragfield.report.figures.side_by_side import FigureQueue
from fragfield.report.reading.run_files import read_run
from tests.fragfield.synthetic_run import write_run

pytestmark = pytest.mark.cores

DRAWINGS = {
    "speed_along_round": burst_figures.speed_along_round,
    "casing_over_time": burst_figures.casing_over_time,
}


def nothing(_run):
    """A figure without data."""
    return


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    return read_run(write_run(tmp_path_factory.mktemp("side") / "run", rounds=1))


def test_figures_are_drawn_to_the_same_bytes_each_time(run):
    found = []
    for _ in range(2):
        figures = FigureQueue()
        for name, function in DRAWINGS.items():
            figures.add(name, function)
        figures.add("nothing", nothing)
        found.append(figures.finish(run))
    assert found[0] == found[1]
    assert found[0]["nothing"] is None
    assert found[0]["speed_along_round"]["png"].startswith(b"\x89PNG")
    assert figures._process is None


def test_an_error_of_the_report_ends_the_other_process(run, monkeypatch, tmp_path):
    monkeypatch.setattr(side_by_side, "_SERVE", "input(); import time; time.sleep(600)")
    figures = FigureQueue()
    figures.add_picture("picture_of_burst", run.folder, tmp_path)
    thread = figures._thread
    while figures._process is None:
        thread.join(timeout=0.05)
    figures.close()
    thread.join(timeout=30.0)
    assert not thread.is_alive()
    assert figures._process.returncode is not None


_DIES = "import sys; input(); sys.stderr.write('no driver\\n'); sys.stderr.flush(); import os; os.kill(os.getpid(), 11)"


def test_where_vtk_ends_the_helper_the_report_goes_on_and_says_so(run, monkeypatch, tmp_path):
    monkeypatch.setattr(side_by_side, "_SERVE", _DIES)
    figures = FigureQueue()
    figures.add("speed_along_round", DRAWINGS["speed_along_round"])
    figures.add_picture("picture_of_burst", run.folder, tmp_path)
    figures.add_picture("picture_of_fragments", run.folder, tmp_path)
    assert list(figures.finish(run)) == ["speed_along_round"]
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
    monkeypatch.setattr(side_by_side, "_SERVE", f"input(); print('{answer}', flush=True)")
    figures = FigureQueue()
    figures.add_picture("picture_of_burst", run.folder, tmp_path)
    figures.finish(run)
    with pytest.raises(kind, match=words):
        figures.picture("picture_of_burst")
    figures.close()


def test_pictures_are_begun_when_their_stage_is_done_and_drawn_once(tmp_path, monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0, 1})
    monkeypatch.setattr(early, "library_fault", lambda: None)
    monkeypatch.setattr(side_by_side, "_SERVE", _ANSWERS)
    figures = early_figures()
    for stage in ("fly", "burst", "burst"):
        draw_early(figures, tmp_path, stage)
    assert figures._known == {"picture_of_burst"}
    figures.add_picture("picture_of_burst", tmp_path, tmp_path)
    draw_early(figures, tmp_path, "break-up")
    assert figures.finish(read_run(write_run(tmp_path / "run", stages=0))) == {}
    assert [figures.picture(name)["view"] for name in ("picture_of_burst", "picture_of_fragments")] == ["1", "2"]
    figures.close()


_ANSWERS = """
import json, sys
for number, line in enumerate(sys.stdin, start=1):
    print(json.dumps({"view": str(number)}), flush=True)
"""


def test_on_one_core_nothing_is_begun_early(monkeypatch):
    monkeypatch.setattr(os, "sched_getaffinity", lambda _: {0})
    assert early_figures() is None
