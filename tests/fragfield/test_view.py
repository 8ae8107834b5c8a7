"""Pictures: drawn where VTK can, a clear word where it cannot, and sections that show what was computed."""

from __future__ import annotations

import ctypes
import subprocess
import sys
from typing import TYPE_CHECKING

import h5py
import numpy as np
import pytest

from fragfield.errors import InputError
from fragfield.interface.results import Run
from fragfield.report import assemble, write_report
from fragfield.view import burst_sections, picture_fault, view_run
from fragfield_base.hdf5_files import creating
from tests.fragfield.short_run import ROOT
from tests.fragfield.synthetic_run import END_TIME, write_run

if TYPE_CHECKING:
    from pathlib import Path

needs_vtk = pytest.mark.skipif(bool(picture_fault()), reason=picture_fault())


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return write_run(tmp_path_factory.mktemp("view") / "run", stages=2)


@needs_vtk
def test_pictures_show_something(run):
    from matplotlib.image import imread

    # In a process of its own, as the command is: VTK ends one in which much else was loaded before.
    subprocess.run([sys.executable, "-m", "fragfield", "view", str(run), "--quiet"], cwd=ROOT, check=True, timeout=300)
    written = sorted((run / "figures").glob("picture_of_*.png"))
    assert [path.name for path in written] == ["picture_of_burst.png", "picture_of_fragments.png"]
    for path in written:
        pixels = imread(path)[..., :3]
        coloured = (np.ptp(pixels, axis=2) > 0.1).mean()
        assert coloured > 0.05, f"{path.name}: only {coloured:.1%} of the picture is coloured"


def test_missing_library_is_reported_and_the_report_goes_on(run, monkeypatch):
    def missing(name):
        raise OSError(name)

    monkeypatch.setattr(ctypes, "CDLL", missing)
    with pytest.raises(InputError, match=r"needs libEGL or libOSMesa.*apt-get install libegl1"):
        view_run(run)
    text = write_report(run).read_text(encoding="utf-8")
    assert text.count("No picture: VTK needs libEGL or libOSMesa") == 2
    assert "figure-speed_along_round" in text


@pytest.mark.parametrize(
    ("child", "words"),
    [
        ("import os; os.write(2, b'no EGL\\n'); os.kill(os.getpid(), 11)", "VTK fails to draw .*no EGL"),
        ("import os; os.write(2, b'burst.h5: damaged\\n'); os._exit(2)", None),
    ],
)
def test_an_end_of_the_drawing_process_does_not_end_the_report(run, monkeypatch, child, words):
    """A library without a driver ends VTK's process by a signal; errors of ours come as what they are."""

    def start(*_, stderr):
        return subprocess.Popen([sys.executable, "-c", child], stderr=stderr)

    monkeypatch.setattr(assemble, "FIGURES", {})
    monkeypatch.setattr(assemble, "picture_fault", lambda: "")
    monkeypatch.setattr(assemble, "start_function", start)
    if words is None:
        with pytest.raises(InputError, match=r"burst\.h5: damaged"):
            write_report(run)
    else:
        assert write_report(run).read_text(encoding="utf-8").count("No picture: VTK fails to draw") == 2


def ends(outline) -> set[int]:
    """Numbers of edges that meet at the points of an outline."""
    return set(np.bincount(outline.lines.reshape(-1, 3)[:, 1:].ravel()))


def test_the_section_is_that_of_the_snapshot_halfway_and_at_the_end(run):
    """The plane spans the rounds; the outline is closed: two edges meet at every point."""
    files = Run(run)
    (half, before, _), (end, section, outline) = burst_sections(files)
    assert half == pytest.approx(0.5 * END_TIME, rel=0.4)
    assert end == END_TIME
    position, velocity = files.snapshot.nodes["position"], files.snapshot.nodes["velocity"]
    low, high = position.min(axis=0), position.max(axis=0)
    assert section.bounds[:2] == pytest.approx((low[0], high[0]), rel=1e-3)
    assert section.bounds[4:] == pytest.approx((low[2], high[2]), rel=1e-3)
    assert np.abs(section.points[:, 1]).max() < 1e-3 * (high[1] - low[1])
    assert before.bounds[1] < section.bounds[1]
    assert 0.5 < section["speed"].max() / np.linalg.norm(velocity, axis=1).max() <= 1.0 + 1e-6
    assert ends(outline) == {2}


def test_a_run_without_its_series_shows_its_end(tmp_path):
    folder = write_run(tmp_path / "run", stages=1)
    (folder / "burst.xdmf").unlink()
    assert [time for time, *_ in burst_sections(Run(folder))] == [END_TIME]


def test_rounds_behind_planes_of_symmetry_are_shown_and_the_front_row_is_cut(tmp_path, run):
    """One round before two planes of symmetry that meet at right angles: a quarter of a stack of four."""
    folder = write_run(tmp_path / "run", stages=1)
    with h5py.File(folder / "burst_snapshot.h5", "a") as file:
        for number, (name, normal) in enumerate((("x", (1.0, 0.0, 0.0)), ("y", (0.0, -3.0, 0.0)))):
            group = file.create_group(f"planes/{number}")
            group.attrs.update({"name": name, "point": -0.25 * np.sign(normal), "normal": normal})
    alone = burst_sections(Run(run))[-1][1]
    for _, section, outline in burst_sections(Run(folder)):
        assert section.bounds[0] == pytest.approx(-0.5 - section.bounds[1], rel=1e-6)
        assert np.ptp(section.points[:, 1]) < 1e-6  # through the front row at all times, not between the rows
        assert abs(float(section.points[0, 1])) < 1e-3
        assert ends(outline) == {2}
    assert section.n_cells == 2 * alone.n_cells
    assert section["speed"].max() == pytest.approx(alone["speed"].max(), rel=1e-3)


def test_an_axisymmetric_burst_is_shown_on_both_sides_of_its_axis(tmp_path, run):
    files = Run(write_run(tmp_path / "run", axisymmetric=True))
    assert files.snapshot.is_axisymmetric
    solid = burst_sections(Run(run))[-1][1]
    sections = burst_sections(files)
    assert len(sections) == 2
    for _, section, outline in sections:
        assert section.bounds[0] == pytest.approx(-section.bounds[1], rel=1e-9)
        assert ends(outline) == {2}
        assert set(section["part"]) == {0, 1}
    assert sections[-1][1].bounds[1] == pytest.approx(solid.bounds[1], rel=1e-3)
    assert sections[-1][1]["speed"].max() == pytest.approx(solid["speed"].max(), rel=1e-3)


@pytest.mark.parametrize("name", ["burst/0000.h5", "burst.xdmf"])
def test_a_damaged_series_is_refused_before_vtk_sees_it(tmp_path, name):
    folder = write_run(tmp_path / "run", stages=2)
    data = bytearray((folder / name).read_bytes())
    data[len(data) // 2] ^= 1
    (folder / name).write_bytes(data)
    with pytest.raises(InputError, match=rf"{name}: damaged.*run `fragfield burst` again"):
        burst_sections(Run(folder))


def test_a_series_that_takes_data_from_elsewhere_is_refused(tmp_path):
    folder = write_run(tmp_path / "run", stages=2)
    text = (folder / "burst.xdmf").read_text().rpartition("<!-- checksum")[0]
    (folder / "burst.xdmf").write_text(text.replace("burst/0000.h5:", "/etc/secret.h5:", 1))
    with pytest.raises(InputError, match=r"takes data from '/etc/secret.h5:/.*'; allowed: burst.h5:/, burst/0000.h5:/"):
        burst_sections(Run(folder))


def test_another_file_in_place_of_the_series_is_refused_before_vtk_sees_it(tmp_path):
    """Whole and sealed, but without the arrays that burst.xdmf names."""
    folder = write_run(tmp_path / "run", stages=2)
    with creating(folder / "burst" / "0000.h5", InputError) as file:
        file["cells"] = np.zeros((2, 8), dtype=np.int64)
    with pytest.raises(InputError, match=r"0000.h5: damaged, or of another run: /.* has the shape"):
        burst_sections(Run(folder))
