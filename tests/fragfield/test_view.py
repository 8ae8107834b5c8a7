"""Pictures: drawn where VTK can, and a clear word where it cannot."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING

import h5py
import numpy as np
import pytest

from fragfield.errors import InputError
from fragfield.report import read_run, write_report
from fragfield.view import PictureUnavailableError, offscreen, offscreen_fault
from fragfield.view.scenes import burst_at, burst_states, burst_times, cut, final_burst, middle_plane, section
from fragfield.view.show import view_run
from fragfield_base.hdf5_files import creating
from tests.fragfield.synthetic_run import END_TIME, write_run

if TYPE_CHECKING:
    from pathlib import Path

needs_vtk = pytest.mark.skipif(bool(offscreen_fault()), reason=offscreen_fault())


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return write_run(tmp_path_factory.mktemp("view") / "run", stages=2)


@needs_vtk
def test_pictures_show_something(run):
    from matplotlib.image import imread

    written = view_run(run)
    assert [path.name for path in written] == ["picture_of_burst.png", "picture_of_fragments.png"]
    for path in written:
        pixels = imread(path)[..., :3]
        coloured = (np.ptp(pixels, axis=2) > 0.1).mean()
        assert coloured > 0.05, f"{path.name}: only {coloured:.1%} of the picture is coloured"


def test_missing_library_is_reported_and_the_report_goes_on(run, monkeypatch):
    monkeypatch.setattr(offscreen, "_loadable", lambda name: False)
    with pytest.raises(PictureUnavailableError, match=r"needs libEGL or libOSMesa.*apt-get install libegl1"):
        view_run(run)
    text = write_report(run).read_text(encoding="utf-8")
    assert text.count("No picture: VTK needs libEGL or libOSMesa") == 2
    assert "figure-speed_along_round" in text


@pytest.mark.parametrize(
    ("child", "kind", "words"),
    [
        ("import os; os.write(2, b'no EGL\\n'); os.kill(os.getpid(), 11)", PictureUnavailableError, "fails .*no EGL"),
        ("import os; os.write(2, b'burst.h5: damaged\\n'); os._exit(2)", InputError, "burst.h5: damaged"),
    ],
)
def test_an_end_of_the_drawing_process_is_reported(run, tmp_path, monkeypatch, child, kind, words):
    """A library without a driver ends VTK's process by a signal; errors of ours come as what they are."""
    python = tmp_path / "python"
    python.write_text(f'#!/bin/sh\nexec {sys.executable} -c "{child}"\n')
    python.chmod(0o700)
    monkeypatch.setattr(offscreen, "offscreen_fault", lambda: "")
    monkeypatch.setattr(offscreen.sys, "executable", str(python))
    with pytest.raises(kind, match=words):
        view_run(run)


def test_a_window_without_a_display_is_refused(run, monkeypatch):
    monkeypatch.delenv("DISPLAY", raising=False)
    with pytest.raises(InputError, match="--window: DISPLAY is not set"):
        view_run(run, window=True)


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


def test_states_are_even_in_time_and_end_with_the_burst(run):
    times = [time for time, _ in burst_states(read_run(run), 3)]
    assert times == pytest.approx([END_TIME / 3.0, 2.0 * END_TIME / 3.0, END_TIME], rel=1e-9)
    assert times[-1] == END_TIME


@pytest.fixture(scope="module")
def mirrored(tmp_path_factory) -> Path:
    """One round before two planes of symmetry that meet at right angles: a quarter of a stack of four."""
    folder = write_run(tmp_path_factory.mktemp("mirrored") / "run", stages=1)
    with h5py.File(folder / "burst_snapshot.h5", "a") as file:
        for number, (name, normal) in enumerate((("x", (1.0, 0.0, 0.0)), ("y", (0.0, -3.0, 0.0)))):
            group = file.create_group(f"planes/{number}")
            group.attrs.update({"name": name, "point": -0.25 * np.sign(normal), "normal": normal})
    return folder


def test_rounds_behind_planes_of_symmetry_are_shown(run, mirrored):
    """At every time: four rounds, none of their cells inside out, each as fast as the one that was computed."""
    alone, files = final_burst(read_run(run)), read_run(mirrored)
    for whole in (final_burst(files), burst_at(files, burst_times(files)[-1])):
        assert whole.n_cells == 4 * alone.n_cells
        assert whole.bounds[:4] == pytest.approx(
            [-0.5 - alone.bounds[1], alone.bounds[1], alone.bounds[2], 0.5 - alone.bounds[2]], rel=1e-6
        )
        assert whole.compute_cell_sizes()["Volume"].min() > 0.0
        assert whole["speed"].max() == pytest.approx(alone["speed"].max(), rel=1e-6)
        assert whole["part"].sum() == 4 * alone["part"].sum()


def test_a_stack_is_cut_through_its_front_row(mirrored):
    """Not between the rows, where nothing would be cut: half of the front row is left and all behind it."""
    grid = final_burst(read_run(mirrored))
    assert middle_plane(grid) == pytest.approx(0.0, abs=1e-9)
    assert section(grid).n_cells == 3 * grid.n_cells // 4
    plane, _ = cut(grid)
    assert plane.n_cells > 0


def test_the_section_stays_where_it_is_while_the_burst_grows(mirrored):
    """It depends on the rounds at rest: a cloud that leans to one side does not move it."""
    planes = {middle_plane(grid) for _, grid in burst_states(read_run(mirrored), 3)}
    assert planes == {middle_plane(final_burst(read_run(mirrored)))}


def test_cut_shows_the_plane_and_the_outline_of_the_casing(run):
    """The plane spans the grid; the outline is closed: two edges meet at every point."""
    grid = final_burst(read_run(run))
    plane, outline = cut(grid)
    depth = grid.bounds[3] - grid.bounds[2]
    assert np.abs(plane.points[:, 1]).max() < 1e-3 * depth
    assert plane.bounds[:2] == pytest.approx(grid.bounds[:2], rel=1e-3)
    ends = outline.lines.reshape(-1, 3)[:, 1:]
    assert set(np.bincount(ends.ravel())) == {2}


@pytest.mark.parametrize("name", ["burst/0000.h5", "burst.xdmf"])
def test_a_damaged_series_is_refused_before_vtk_sees_it(tmp_path, name):
    folder = write_run(tmp_path / "run", stages=2)
    data = bytearray((folder / name).read_bytes())
    data[len(data) // 2] ^= 1
    (folder / name).write_bytes(data)
    with pytest.raises(InputError, match=rf"{name}: damaged.*run `fragfield burst` again"):
        burst_states(read_run(folder), 3)


def test_a_series_that_takes_data_from_elsewhere_is_refused(tmp_path):
    folder = write_run(tmp_path / "run", stages=2)
    text = (folder / "burst.xdmf").read_text().rpartition("<!-- checksum")[0]
    (folder / "burst.xdmf").write_text(text.replace("burst/0000.h5:", "/etc/secret.h5:", 1))
    with pytest.raises(InputError, match=r"takes data from '/etc/secret.h5:/.*'; allowed: burst.h5:/, burst/0000.h5:/"):
        burst_states(read_run(folder), 3)


def test_another_file_in_place_of_the_series_is_refused_before_vtk_sees_it(tmp_path):
    """Whole and sealed, but without the arrays that burst.xdmf names."""
    folder = write_run(tmp_path / "run", stages=2)
    with creating(folder / "burst" / "0000.h5", InputError) as file:
        file["cells"] = np.zeros((2, 8), dtype=np.int64)
    with pytest.raises(InputError, match=r"0000.h5: damaged, or of another run: /.* has the shape"):
        burst_states(read_run(folder), 3)
