"""The time series is read back through VTK and compared with what was written."""

from __future__ import annotations

import subprocess
import sys
import textwrap
from pathlib import Path
from xml.etree import ElementTree as ET

import h5py
import numpy as np
import pytest

from burst_fenicsx.errors import InputError
from burst_fenicsx.files.output import TimeSeries

TIMES = (0.0, 1.0e-6 / 3.0, 1.2e-4)


def box(count: int = 3) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and cells (VTK order) of a cube of count^3 hexahedra."""
    axis = np.linspace(0.0, 0.3, count + 1)
    x, y, z = np.meshgrid(axis, axis, axis, indexing="ij")
    number = np.arange((count + 1) ** 3).reshape(3 * (count + 1,))
    corners = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
    cells = [number[i : i + count, j : j + count, k : k + count].ravel() for i, j, k in corners]
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), np.column_stack(cells)


def state(step: int, nodes: int, cells: int) -> tuple[dict[str, np.ndarray], dict[str, np.ndarray]]:
    """Every kind of field that the burst writes, different at each step."""
    random = np.random.default_rng(step)
    scalar = ("pressure", "tresca", "plastic_shear_strain", "plastic_volumetric_strain", "burn_fraction", "density")
    tensor = random.normal(size=(cells, 3, 3)) * 1e9
    cell_data = {name: random.normal(size=cells) for name in scalar}
    cell_data["stress"] = tensor + tensor.transpose(0, 2, 1)
    cell_data |= {"part": np.arange(cells) % 3, "round": np.zeros(cells, np.int32), "segment": np.arange(cells) - 1}
    return {"velocity": random.normal(size=(nodes, 3)), "displacement": random.normal(size=(nodes, 3))}, cell_data


def write_all(path: Path, times: tuple[float, ...] = TIMES) -> None:
    points, cells = box()
    series = TimeSeries(path, cells, {"seed": "1", "case": "title = 'ü'"})
    for step, time in enumerate(times):
        point_data, cell_data = state(step, len(points), len(cells))
        series.write(time, points * (1.0 + step), point_data=point_data, cell_data=cell_data)


def test_vtk_reads_one_time_series_equal_to_what_was_written(tmp_path: Path) -> None:
    """Every array at every time, and the times, come back through VTK's reader."""
    import pyvista

    write_all(tmp_path / "burst")
    points, cells = box()
    reader = pyvista.get_reader(str(tmp_path / "burst.xdmf"))
    assert reader.time_values == list(TIMES)
    for step, time in enumerate(TIMES):
        reader.set_active_time_value(time)
        grid = reader.read()
        point_data, cell_data = state(step, len(points), len(cells))
        assert isinstance(grid, pyvista.UnstructuredGrid)
        np.testing.assert_array_equal(grid.points, points * (1.0 + step))
        np.testing.assert_array_equal(grid.cells_dict[pyvista.CellType.HEXAHEDRON], cells)
        assert set(grid.point_data) == set(point_data)
        assert set(grid.cell_data) == set(cell_data)
        for name, expected in point_data.items():
            np.testing.assert_allclose(grid.point_data[name], expected, rtol=1e-6)
        for name, expected in cell_data.items():
            np.testing.assert_allclose(grid.cell_data[name], expected.reshape(grid[name].shape), rtol=1e-6)


def test_files_are_complete_after_every_write(tmp_path: Path) -> None:
    """Each time, the XML parses and names only arrays that exist with the stated size."""
    points, cells = box()
    series = TimeSeries(tmp_path / "burst", cells)
    for step, time in enumerate(TIMES):
        point_data, cell_data = state(step, len(points), len(cells))
        series.write(time, points, point_data=point_data, cell_data=cell_data)
        root = ET.parse(tmp_path / "burst.xdmf").getroot()
        assert [float(item.get("Value", "")) for item in root.iter("Time")] == list(TIMES[: step + 1])
        for item in root.iter("DataItem"):
            name, dataset = (item.text or "").split(":")
            with h5py.File(tmp_path / name) as file:
                assert file[dataset].shape == tuple(int(word) for word in item.get("Dimensions", "").split())
    assert "XInclude" not in (tmp_path / "burst.xdmf").read_text()
    assert sorted(path.name for path in (tmp_path / "burst").iterdir()) == ["0000.h5", "0001.h5", "0002.h5"]


def test_killed_run_keeps_its_outputs(tmp_path: Path) -> None:
    """A process that dies without closing leaves a series that VTK reads."""
    import pyvista

    script = f"""
        import os, sys
        sys.path[:0] = [{str(Path(__file__).parent)!r}, {str(Path.cwd())!r}]
        from test_output import TIMES, TimeSeries, box, state
        points, cells = box()
        series = TimeSeries({str(tmp_path / "burst")!r}, cells)
        for step, time in enumerate(TIMES[:2]):
            series.write(time, points, *state(step, len(points), len(cells)))
        os.kill(os.getpid(), 9)
    """
    done = subprocess.run([sys.executable, "-c", textwrap.dedent(script)], capture_output=True, text=True, check=False)
    assert done.returncode == -9, done.stderr
    reader = pyvista.get_reader(str(tmp_path / "burst.xdmf"))
    assert reader.time_values == list(TIMES[:2])
    reader.set_active_time_value(TIMES[1])
    np.testing.assert_allclose(reader.read()["pressure"], state(1, 64, 27)[1]["pressure"], rtol=1e-6)


@pytest.mark.parametrize("kept", [0, 1, 2])
def test_a_resumed_series_has_the_text_of_one_that_was_not(tmp_path: Path, kept: int) -> None:
    """Later states are gone from the folder too, until they are written again."""
    write_all(tmp_path / "burst")
    whole = (tmp_path / "burst.xdmf").read_text()
    points, cells = box()
    series = TimeSeries(tmp_path / "burst", cells, resume_at=TIMES[kept])
    assert len(list((tmp_path / "burst").iterdir())) == kept + 1
    for step, time in enumerate(TIMES[kept + 1 :], kept + 1):
        series.write(time, points + step * 1e-3, *state(step, len(points), len(cells)))
    assert (tmp_path / "burst.xdmf").read_text() == whole
    with pytest.raises(InputError, match="not the time series of this mesh"):
        TimeSeries(tmp_path / "burst", cells[:-1], resume_at=TIMES[kept])


def test_provenance_is_kept_however_long(tmp_path: Path) -> None:
    """A resolved case above HDF5's classic 64 kB limit is stored too."""
    case = "x" * 100_000 + "µ"
    points, cells = box()
    series = TimeSeries(tmp_path / "burst", cells, {"case": case, "seed": "5"})
    series.write(0.0, points)
    with h5py.File(tmp_path / "burst" / "0000.h5") as file:
        assert (file.attrs["case"], file.attrs["seed"], file.attrs["format_version"]) == (case, "5", 2)


def test_wrong_input_is_named_and_leaves_the_series_as_it_was(tmp_path: Path) -> None:
    """Messages name the array, what was found and what is allowed."""
    points, cells = box()
    series = TimeSeries(tmp_path / "burst", cells)
    series.write(1.0, points, cell_data={"part": np.zeros(27)})
    before = (tmp_path / "burst.xdmf").read_text()
    with pytest.raises(InputError, match=r"'part' has shape \(26,\).*expected numbers in \(27,\)"):
        series.write(2.0, points, cell_data={"part": np.zeros(26)})
    with pytest.raises(InputError, match="output at 1 s, the output before is at 1 s"):
        series.write(1.0, points, cell_data={"part": np.zeros(27)})
    with pytest.raises(InputError, match=r"the same fields; differing: \['density', 'part'\]"):
        series.write(2.0, points, cell_data={"density": np.zeros(27)})
    with pytest.raises(InputError, match=r"positions have shape \(64,\)"):
        series.write(2.0, points[:, 0], cell_data={"part": np.zeros(27)})
    with pytest.raises(InputError, match="the cells name node 63, but there are 60 positions"):
        series.write(2.0, points[:60], cell_data={"part": np.zeros(27)})
    assert (tmp_path / "burst.xdmf").read_text() == before
    series.write(2.0, points, cell_data={"part": np.zeros(27)})


def test_refuses_what_is_no_hexahedron_and_an_unwritable_folder(tmp_path: Path) -> None:
    """Faults of the set-up come before the run."""
    with pytest.raises(InputError, match=r"shape \(5, 6\).*whole numbers of shape \(cells, 8\) or \(cells, 4\)"):
        TimeSeries(tmp_path / "burst", np.zeros((5, 6), int))
    with pytest.raises(InputError, match="name a folder that is writable"):
        TimeSeries(tmp_path / "nowhere" / "burst", box()[1])


def test_quadrilaterals_of_a_meridian_are_read_back(tmp_path: Path) -> None:
    """VTK finds quadrilaterals with the fields that were written."""
    pyvista = pytest.importorskip("pyvista")
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 0, 1], [1, 0, 1], [2, 0, 1]], dtype=float)
    cells = np.array([[0, 1, 4, 3], [1, 2, 5, 4]])
    series = TimeSeries(tmp_path / "burst", cells)
    series.write(0.0, points, {"velocity": points}, {"part": np.array([1, 0])})
    series.write(1.0, 2.0 * points, {"velocity": 3.0 * points}, {"part": np.array([1, 0])})
    reader = pyvista.get_reader(str(tmp_path / "burst.xdmf"))
    reader.set_active_time_value(1.0)
    grid = reader.read()
    assert set(grid.celltypes) == {pyvista.CellType.QUAD}
    np.testing.assert_array_equal(grid.cell_connectivity.reshape(-1, 4), cells)
    np.testing.assert_allclose(grid.point_data["velocity"], 3.0 * points)
    assert grid.compute_cell_sizes()["Area"] == pytest.approx([4.0, 4.0])
