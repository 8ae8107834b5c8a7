#!/bin/sh
# Values at points and at cells (a velocity and a pressure, say) in one VTKHDF file of dolfinx 0.11, whose module
# dolfinx.io.vtkhdf has a function for either: the second kind is refused ("Failed to open HDF5 dataset by name"), and the
# refused call has already counted a time step. The file, whole before, then says four steps and holds three; VTK 9.7.2
# reads it with times 0, 1, 2 and a 0 more, and gives the values of time 1 for time 2.
# Needs Python 3.12 or newer (PYTHON=...), x86-64. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
"${PYTHON:-python3}" -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet dolfinx-solver-real==0.11.0.post0 vtk==9.7.2

"$folder/env/bin/python" - "$folder/field.vtkhdf" 2>"$folder/hdf5" <<'PYTHON'
import sys

import dolfinx_solver  # noqa: F401
import numpy as np
from dolfinx import mesh
from dolfinx.io import vtkhdf
from mpi4py import MPI

file = sys.argv[1]
cube = mesh.create_unit_cube(MPI.COMM_SELF, 3, 2, 2, mesh.CellType.hexahedron)
vtkhdf.write_mesh(file, cube)
for time in (0.0, 1.0, 2.0):
    vtkhdf.write_point_data(file, cube, np.full(len(cube.geometry.x), time), time)
try:
    vtkhdf.write_cell_data(file, cube, np.zeros(12), 0.0)
except RuntimeError as error:
    print("cells after points:", error)
else:
    sys.exit("changed: values at points and at cells share a file")
PYTHON
"$folder/env/bin/python" - "$folder/field.vtkhdf" 2>"$folder/vtk" <<'PYTHON'
import sys

import vtk

reader = vtk.vtkHDFReader()
reader.SetFileName(sys.argv[1])
reader.UpdateInformation()
times = reader.GetOutputInformation(0).Get(vtk.vtkStreamingDemandDrivenPipeline.TIME_STEPS())
values = {}
for time in (0.0, 1.0, 2.0):
    reader.UpdateTimeStep(time)
    values[time] = reader.GetOutputDataObject(0).GetPointData().GetArray("u").GetValue(0)
print("times:", times, "values:", values)
assert times == (0.0, 1.0, 2.0, 0.0) and values == {0.0: 0.0, 1.0: 1.0, 2.0: 1.0}, "changed: the refused call leaves the file whole"
PYTHON
echo "as described: the refused call damages the series"
