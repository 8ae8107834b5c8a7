"""An axisymmetric burst is shown and measured as before: its meridian is revolved."""

from __future__ import annotations

from typing import TYPE_CHECKING

import h5py
import numpy as np
import pytest

from fragfield.report import read_run
from fragfield.view.scenes import burst_at, burst_times, cut, final_burst, section
from tests.fragfield.synthetic_run import write_run

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return write_run(tmp_path_factory.mktemp("axisymmetric") / "run", axisymmetric=True)


@pytest.fixture(scope="module")
def solid(tmp_path_factory) -> Path:
    return write_run(tmp_path_factory.mktemp("solid") / "run", stages=1)


def test_the_revolved_burst_is_that_of_hexahedra(run, solid):
    """Size, volume, speed and parts, at the end and in the series."""
    files, other = read_run(run), read_run(solid)
    assert files.is_axisymmetric
    assert not other.is_axisymmetric
    assert "geometry" not in files.provenance
    wanted = final_burst(other)
    volume = float(wanted.compute_cell_sizes()["Volume"].sum())
    for grid in (final_burst(files), burst_at(files, burst_times(files)[-1])):
        assert grid.bounds == pytest.approx(wanted.bounds, abs=1e-3)
        found = grid.compute_cell_sizes()["Volume"]
        assert found.min() > 0.0
        chords = [np.sin(2.0 * np.pi / n) * n for n in (96, 24)]
        assert found.sum() == pytest.approx(volume * chords[0] / chords[1], rel=0.01)  # the bore is open there
        assert grid["speed"].max() == pytest.approx(wanted["speed"].max(), rel=1e-6)
        assert set(grid["part"]) == {0, 1}
        casing = grid.extract_cells(np.flatnonzero(grid["part"] == 0)).compute_cell_sizes()["Volume"].sum()
        hexahedral = wanted.extract_cells(np.flatnonzero(wanted["part"] == 0)).compute_cell_sizes()["Volume"].sum()
        assert casing == pytest.approx(hexahedral * chords[0] / chords[1], rel=1e-6)


def test_the_section_cuts_between_cells(run):
    grid = final_burst(read_run(run))
    half = section(grid)
    assert half.n_cells * 2 == grid.n_cells
    plane, outline = cut(grid)
    assert plane.bounds[:2] == pytest.approx(grid.bounds[:2], rel=1e-3)
    ends = outline.lines.reshape(-1, 3)[:, 1:]
    assert set(np.bincount(ends.ravel())) == {2}


def test_images_of_wedges_are_not_inside_out(tmp_path):
    folder = write_run(tmp_path / "run", stages=1, axisymmetric=True)
    with h5py.File(folder / "burst_snapshot.h5", "a") as file:
        file.create_group("planes/0").attrs.update(
            {"name": "x", "point": np.array([-0.25, 0.0, 0.0]), "normal": np.array([1.0, 0.0, 0.0])}
        )
    grid = final_burst(read_run(folder))
    found = grid.compute_cell_sizes()["Volume"]
    assert found.min() > 0.0
    centres = grid.cell_centers().points[:, 0]
    assert found[centres > -0.25].sum() == pytest.approx(found[centres < -0.25].sum(), rel=1e-9)
    casing = np.flatnonzero(grid["part"] == 0)
    assert grid.extract_cells(casing).bounds == pytest.approx(grid.bounds)  # parts stay with their cells
