"""Pictures: sections that show what was computed, and damaged series refused."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING

import h5py
import numpy as np
import pytest

from fragfield.errors import InputError
from fragfield.interface.results import Run
from fragfield.report.figures.pictures import burst_sections
from fragfield.view import view_run
from fragfield_base.hdf5_files import creating
from tests.fragfield.synthetic_run import END_TIME, write_run

if TYPE_CHECKING:
    from pathlib import Path


@pytest.fixture(scope="module")
def run(tmp_path_factory) -> Path:
    return write_run(tmp_path_factory.mktemp("view") / "run", stages=2)


def test_pictures_show_something(run):
    from matplotlib.image import imread

    written = view_run(run)
    assert written == [run / "figures" / f"picture_of_{name}.png" for name in ("burst", "fragments")]
    for path in written:
        pixels = imread(path)[..., :3]
        coloured = (np.ptp(pixels, axis=2) > 0.1).mean()
        assert coloured > 0.05, f"{path.name}: only {coloured:.1%} of the picture is coloured"


def test_a_run_without_burst_and_fragments_has_nothing_to_show(tmp_path):
    with pytest.raises(InputError, match="nothing to show; run `fragfield burst`"):
        view_run(write_run(tmp_path / "run", stages=0))


def ends(outline) -> set[int]:
    """Numbers of lines that meet at the points of an outline."""
    return set(Counter(map(tuple, np.round(outline.reshape(-1, 2), 9).tolist())).values())


def area(section) -> float:
    """Area (m^2) of the triangles."""
    first, second, third = (section.points[section.triangles[:, corner]] for corner in range(3))
    (across, up), (across_2, up_2) = (second - first).T, (third - first).T
    return float(0.5 * np.abs(across * up_2 - up * across_2).sum())


def area_by_vtk(burst) -> float:
    """The same of VTK's own slice through an axis at y = 0."""
    import pyvista

    position = burst.mesh.position
    grid = pyvista.UnstructuredGrid({pyvista.CellType.HEXAHEDRON: burst.mesh.cells}, position)
    section = grid.slice(normal="y", origin=(0.0, 1e-4 * np.ptp(position[:, 1]), 0.0))
    return float(section.compute_cell_sizes()["Area"].sum())


def test_the_section_is_that_of_the_snapshot_halfway_and_at_the_end(run):
    """The plane spans the rounds; the outline is closed: two lines meet at every point."""
    files = Run(run)
    before, section = burst_sections(files)
    assert before.time == pytest.approx(0.5 * END_TIME, rel=0.4)
    assert section.time == END_TIME
    position, velocity = files.snapshot.mesh.position, files.snapshot.mesh.velocity
    low, high = position.min(axis=0), position.max(axis=0)
    assert section.points.min(axis=0) == pytest.approx(low[[0, 2]], rel=1e-3)
    assert section.points.max(axis=0) == pytest.approx(high[[0, 2]], rel=1e-3)
    assert area(section) == pytest.approx(area_by_vtk(files.snapshot), rel=1e-9)
    assert before.points[:, 0].max() < section.points[:, 0].max()
    assert 0.5 < section.speed.max() / np.linalg.norm(velocity, axis=1).max() <= 1.0 + 1e-6
    assert ends(section.outline) == {2}


def test_a_run_without_its_series_shows_its_end(tmp_path):
    folder = write_run(tmp_path / "run", stages=1)
    (folder / "burst.xdmf").unlink()
    assert [one.time for one in burst_sections(Run(folder))] == [END_TIME]


def test_rounds_behind_planes_of_symmetry_are_shown_and_the_front_row_is_cut(tmp_path, run):
    """One round before two planes of symmetry that meet at right angles: a quarter of a stack of four."""
    folder = write_run(tmp_path / "run", stages=1)
    with h5py.File(folder / "burst_snapshot.h5", "a") as file:
        for number, (name, normal) in enumerate((("x", (1.0, 0.0, 0.0)), ("y", (0.0, -3.0, 0.0)))):
            group = file.create_group(f"planes/{number}")
            group.attrs.update({"name": name, "point": -0.25 * np.sign(normal), "normal": normal})
    alone = burst_sections(Run(run))[-1]
    for section in burst_sections(Run(folder)):
        assert section.points[:, 0].min() == pytest.approx(-0.5 - section.points[:, 0].max(), rel=1e-6)
        assert ends(section.outline) == {2}
    assert area(section) == pytest.approx(2.0 * area(alone), rel=1e-3)  # of the front row, at its axis
    assert section.speed.max() == pytest.approx(alone.speed.max(), rel=1e-3)


def test_an_axisymmetric_burst_is_shown_on_both_sides_of_its_axis(tmp_path, run):
    files = Run(write_run(tmp_path / "run", axisymmetric=True))
    assert files.snapshot.mesh.is_axisymmetric
    solid = burst_sections(Run(run))[-1]
    sections = burst_sections(files)
    assert len(sections) == 2
    for section in sections:
        assert section.points[:, 0].min() == pytest.approx(-section.points[:, 0].max(), rel=1e-9)
        assert ends(section.outline) == {2}
    assert sections[-1].points[:, 0].max() == pytest.approx(solid.points[:, 0].max(), rel=1e-3)
    two = files.snapshot.mesh.position[:, ::2][files.snapshot.mesh.cells]
    shoelace = np.cross(two[:, 2] - two[:, 0], two[:, 3] - two[:, 1])
    assert area(sections[-1]) == pytest.approx(np.abs(shoelace).sum(), rel=1e-9)  # twice the half of it
    assert sections[-1].speed.max() == pytest.approx(solid.speed.max(), rel=1e-3)


@pytest.mark.parametrize("name", ["burst/0000.h5", "burst.xdmf"])
def test_a_damaged_series_is_refused(tmp_path, name):
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


def test_another_file_in_place_of_the_series_is_refused(tmp_path):
    """Whole and sealed, but without the arrays that burst.xdmf names."""
    folder = write_run(tmp_path / "run", stages=2)
    with creating(folder / "burst" / "0000.h5", InputError) as file:
        file["cells"] = np.zeros((2, 8), dtype=np.int64)
    with pytest.raises(InputError, match=r"0000.h5: damaged, or of another run: /.* has the shape"):
        burst_sections(Run(folder))
