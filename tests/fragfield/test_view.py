"""Pictures: drawn where VTK can, and a clear word where it cannot."""

from __future__ import annotations

import subprocess
from pathlib import Path

import numpy as np
import pytest

from fragfield.errors import InputError
from fragfield.report import read_run, write_report
from fragfield.view import PictureUnavailableError, display_available, offscreen, offscreen_fault, view_run
from fragfield.view.scenes import burst_at, burst_times, cut, final_burst, section
from tests.fragfield.synthetic_run import END_TIME, write_run

needs_vtk = pytest.mark.skipif(offscreen_fault() is not None, reason=str(offscreen_fault()))


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return write_run(tmp_path_factory.mktemp("view") / "run", stages=2)


@pytest.fixture
def _fresh_check():
    offscreen_fault.cache_clear()
    yield
    offscreen_fault.cache_clear()


@needs_vtk
def test_pictures_show_something(run):
    from matplotlib.image import imread

    written = view_run(run, window=False)
    assert [path.name for path in written] == ["picture_of_burst.png", "picture_of_fragments.png"]
    for path in written:
        pixels = imread(path)[..., :3]
        coloured = (np.ptp(pixels, axis=2) > 0.1).mean()
        assert coloured > 0.05, f"{path.name}: only {coloured:.1%} of the picture is coloured"


def test_series_ends_in_the_state_of_the_snapshot(run):
    files = read_run(run)
    times = burst_times(files)
    assert times[-1] == END_TIME
    last, final = burst_at(files, times[-1]), final_burst(files)
    np.testing.assert_allclose(last.points, final.points)
    np.testing.assert_allclose(last["speed"], final["speed"], rtol=1e-6, atol=1e-3)


def test_section_keeps_the_half_behind_whole(run):
    grid = final_burst(read_run(run))
    half = section(grid)
    assert half.n_cells * 2 == grid.n_cells
    assert half.cell_centers().points[:, 1].min() >= 0.0


def test_cut_shows_the_plane_and_the_outline_of_the_casing(run):
    """The plane spans the grid; the outline is closed: two edges meet at every point."""
    grid = final_burst(read_run(run))
    plane, outline = cut(grid)
    depth = grid.bounds[3] - grid.bounds[2]
    assert np.abs(plane.points[:, 1]).max() < 1e-3 * depth
    assert plane.bounds[:2] == pytest.approx(grid.bounds[:2], rel=1e-3)
    ends = outline.lines.reshape(-1, 3)[:, 1:]
    assert set(np.bincount(ends.ravel())) == {2}


@pytest.mark.usefixtures("_fresh_check")
def test_missing_library_is_told_and_the_report_goes_on(run, monkeypatch):
    monkeypatch.setattr(offscreen, "_loadable", lambda name: False)
    with pytest.raises(PictureUnavailableError, match=r"needs libEGL or libOSMesa.*apt-get install libegl1"):
        view_run(run, window=False)
    text = write_report(run).read_text(encoding="utf-8")
    assert text.count("No picture: VTK needs libEGL or libOSMesa") == 2
    assert "figure-speed_along_round" in text


@pytest.mark.usefixtures("_fresh_check")
def test_driver_that_ends_vtk_by_a_signal_is_told(monkeypatch):
    """A library without a driver kills VTK; the trial dies in its stead."""
    monkeypatch.setattr(offscreen, "_loadable", lambda name: name == "libEGL.so.1")
    monkeypatch.setattr(offscreen, "_TRIAL", "import os; os.kill(os.getpid(), 11)")
    fault = offscreen_fault()
    assert fault is not None
    assert "VTK fails to draw without a window here (exit code -11)" in fault


@pytest.mark.usefixtures("_fresh_check")
def test_trial_runs_once(monkeypatch):
    calls = []

    def count(*command, **options):
        calls.append(command)
        return subprocess.CompletedProcess(command, 0, "", "")

    monkeypatch.setattr(offscreen, "_loadable", lambda name: True)
    monkeypatch.setattr(subprocess, "run", count)
    assert offscreen_fault() is None
    assert offscreen_fault() is None
    assert len(calls) == 1


def test_nothing_to_look_at(tmp_path):
    folder = write_run(tmp_path / "run", stages=0)
    with pytest.raises(InputError, match="nothing to look at; run `fragfield burst`"):
        view_run(folder, window=False)


def test_display_is_that_of_the_environment(monkeypatch):
    for name in ("DISPLAY", "WAYLAND_DISPLAY"):
        monkeypatch.delenv(name, raising=False)
    assert not display_available()
    monkeypatch.setenv("DISPLAY", ":0")
    assert display_available()
