"""An axisymmetric burst is shown and measured as before: its meridian is revolved."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest

from fragfield.report import read_run
from fragfield.report.findings.burst import _folded_casing_cells
from fragfield.report.reading.mesh_quality import aspect_ratio, scaled_jacobian
from fragfield.view import offscreen_fault
from fragfield.view.interactive import interactive_fault
from fragfield.view.scenes import burst_at, burst_states, burst_times, cut, final_burst, section
from tests.fragfield.synthetic_run import END_TIME, write_run

needs_vtk = pytest.mark.skipif(offscreen_fault() is not None, reason=str(offscreen_fault()))
needs_pages = pytest.mark.skipif(interactive_fault() is not None, reason=str(interactive_fault()))


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


def test_series_ends_in_the_state_of_the_snapshot(run):
    files = read_run(run)
    last, final = burst_at(files, burst_times(files)[-1]), final_burst(files)
    np.testing.assert_allclose(last.points, final.points, atol=1e-12)
    np.testing.assert_allclose(last["speed"], final["speed"], rtol=1e-6, atol=1e-3)
    states = burst_states(files, 3)
    assert states[-1][0] == END_TIME
    assert states[0][1].n_cells == final.n_cells


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


@needs_vtk
def test_pictures_look_as_those_of_hexahedra(run, solid, tmp_path):
    """The same pixels but for the polygon of 24 chords and its open bore."""
    from matplotlib.image import imread

    from fragfield.view.pictures import picture_of_burst

    pixels = [imread(picture_of_burst(folder, tmp_path / f"{n}.png"))[..., :3] for n, folder in enumerate((run, solid))]
    height, width = (min(image.shape[axis] for image in pixels) for axis in (0, 1))
    apart = np.abs(pixels[0][:height, :width] - pixels[1][:height, :width]).max(axis=2)
    assert (apart > 0.15).mean() < 0.06
    blank = np.abs(pixels[0][:height, :width] - 1.0).max(axis=2)
    assert (blank > 0.15).mean() > 0.2


def test_quality_of_quadrilaterals():
    """A square is 1, a rhombus of 60 degrees its sine, a folded cell below zero; in any plane and either sense."""
    square = np.array([[0, 0, 0], [1, 0, 0], [1, 0, 1], [0, 0, 1]], dtype=float)
    rhombus = np.array([[0, 0, 0], [1, 0, 0], [1.5, 0, np.sqrt(0.75)], [0.5, 0, np.sqrt(0.75)]]) + np.array([3.0, 0, 0])
    folded = np.array([[0, 0, 0], [1, 0, 0], [0.2, 0, 0.2], [0, 0, 1]], dtype=float) + np.array([6.0, 0, 0])
    nodes, cells = np.concatenate([square, rhombus, folded]), np.arange(12).reshape(3, 4)
    turned = nodes @ np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    for places, order in ((nodes, cells), (turned, cells), (nodes, cells[:, ::-1])):
        found = scaled_jacobian(places, order)
        assert found[:2] == pytest.approx([1.0, np.sqrt(0.75)])
        assert found[2] < 0.0
    assert aspect_ratio(nodes * [2.0, 1.0, 1.0], cells)[0] == pytest.approx(2.0)


def test_folded_cells_of_the_casing_are_counted(run):
    files = read_run(run)
    assert _folded_casing_cells(files) == 0
    cell = files.cells["nodes"][np.flatnonzero(files.cells["part"] == 0)[-1]]
    inner, outer = cell[0], cell[1]
    files.nodes["position"][[inner, outer]] = files.nodes["position"][[outer, inner]]
    assert _folded_casing_cells(files) >= 1
