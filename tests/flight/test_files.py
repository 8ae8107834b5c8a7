"""Files of a flight, read back; ParaView's file through VTK."""

from __future__ import annotations

import json
from pathlib import Path

import h5py
import numpy as np
import pandas as pd
import pytest

from flight import Cylinder, FlightResult, InputError, fly
from flight.files.hdf5 import read_table
from flight.rows import Status
from tests.flight.clouds import cloud

PROVENANCE = {"case": 'title = "a <b> & c"\n', "versions": json.dumps({"flight": "0.1.0"}), "seed": "3"}


@pytest.fixture(scope="module")
def written(tmp_path_factory) -> tuple[FlightResult, Path]:
    folder = tmp_path_factory.mktemp("out") / "run"
    result = fly(cloud(300), witnesses=[Cylinder(7.62, name="ring"), Cylinder(30.0, name="far")], sample=12)
    paths = result.write(folder, PROVENANCE)
    names = ["landing.h5", "landing.csv", "hits.h5", "witness.csv", "trajectories.xdmf", "trajectories.h5"]
    assert [path.name for path in paths] == names
    return result, folder


def test_round_trip(written) -> None:
    result, folder = written
    assert read_table(folder / "landing.h5", "landing")[0].tobytes() == result.landing.tobytes()
    hits, names = read_table(folder / "hits.h5", "hits")
    assert hits.tobytes() == result.hits.tobytes()
    assert names == ["ring", "far"]


def test_provenance_everywhere(written) -> None:
    _, folder = written
    for name in ("landing.h5", "hits.h5", "trajectories.h5"):
        with h5py.File(folder / name) as file:
            assert {key: file.attrs[key] for key in PROVENANCE} == PROVENANCE
    assert "title = &quot;a &lt;b&gt; &amp; c&quot;" in (folder / "trajectories.xdmf").read_text()


def test_csv_copy(written) -> None:
    result, folder = written
    landing, hits = (pd.read_csv(folder / f"{name}.csv") for name in ("landing", "witness"))
    assert landing["distance_m"].to_numpy() == pytest.approx(result.landing["distance"], rel=1e-9)
    assert landing["velocity_z_m_s"].to_numpy() == pytest.approx(result.landing["velocity"][:, 2], rel=1e-9)
    words = [Status(code).name.lower().replace("_", " ") for code in result.landing["status"]]
    assert landing["status_text"].tolist() == words
    assert list(hits.columns[:5]) == ["name", "witness", "fragment", "round", "segment"]
    assert len(hits) == len(result.hits)
    assert set(hits["name"]) <= {"ring", "far"}
    assert (hits["direction_text"].str.startswith("outward") == (hits["direction"] == 1)).all()
    assert [len(table) for table in result.to_pandas()] == [len(result.landing), len(result.hits)]


def test_trajectories_open_in_vtk(written) -> None:
    pytest.importorskip("vtk")
    from vtk import vtkXdmfReader
    from vtk.util.numpy_support import vtk_to_numpy

    result, folder = written
    reader = vtkXdmfReader()
    reader.SetFileName(str(folder / "trajectories.xdmf"))
    reader.Update()
    grid, paths = reader.GetOutputDataObject(0), result.trajectories
    assert grid.GetNumberOfCells() == len(paths) == 12
    assert np.array_equal(vtk_to_numpy(grid.GetPoints().GetData()), paths.position)
    assert np.array_equal(vtk_to_numpy(grid.GetPointData().GetArray("time")), paths.time)
    assert np.array_equal(vtk_to_numpy(grid.GetPointData().GetArray("velocity")), paths.velocity)
    assert np.array_equal(vtk_to_numpy(grid.GetCellData().GetArray("mass")), result.landing["mass"][paths.fragment])
    for i in range(12):
        cell = grid.GetCell(i)
        assert cell.GetClassName() == "vtkPolyLine"
        ids = [cell.GetPointId(k) for k in range(cell.GetNumberOfPoints())]
        assert ids == list(range(paths.start[i], paths.start[i + 1]))


def test_trajectories_start_and_end_with_the_flight(written) -> None:
    result, _ = written
    paths = result.trajectories
    first, last = paths.start[:-1], paths.start[1:] - 1
    assert (paths.position[first] == [0.0, 0.0, 1.5]).all()
    rows = result.landing[paths.fragment]
    assert paths.time[last] == pytest.approx(rows["last_time"], rel=1e-12)
    assert np.abs(paths.position[last] - rows["last_position"]).max() < 1e-9
    for i in range(len(paths)):
        assert (np.diff(paths.time[paths.start[i] : paths.start[i + 1]]) >= 0.0).all()


def test_messages(written, tmp_path) -> None:
    result, folder = written
    cut = tmp_path / "cut.h5"
    cut.write_bytes((folder / "landing.h5").read_bytes()[:5000])
    with pytest.raises(InputError, match="cut off, or not an HDF5 file"):
        read_table(cut, "landing")[0]
    with pytest.raises(InputError, match="attribute format is 'fragfield hits', needed 'fragfield landing'"):
        read_table(folder / "hits.h5", "landing")[0]
    with pytest.raises(InputError, match="cannot be made a folder"):
        result.write(cut / "below")
    with pytest.raises(InputError, match="no witness 'rng'; did you mean 'ring'"):
        result.hits_on("rng")
