#!/bin/sh
# Hexahedra of 20 or 27 nodes through Exodus with meshio 5.3.5: the file gets VTK's order of nodes, whereas Exodus has the
# middles of the upright edges before those of the upper face. meshio reads its own file back as it was; every other
# reader (here VTK 9.5.2, so ParaView) gets cells whose upper and upright edges are swapped: the middle of an edge is
# half a cell off, and no warning. A right file is read by meshio with the same swap. Other formats that
# meshio and gmsh share (gmsh, VTK, MED, Abaqus, Nastran) come through right. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet meshio==5.3.5 netCDF4==1.7.2 vtk==9.5.2 numpy==2.2.6
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import meshio
import numpy as np
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOExodus import vtkExodusIIReader

corners = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
# edges in VTK's order: lower face, upper face, upright
edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
points = np.vstack([corners, [corners[list(edge)].mean(axis=0) for edge in edges]])
meshio.write("cell.e", meshio.Mesh(points, [("hexahedron20", np.arange(20)[None])]))


def off(points, nodes):
    return max(np.abs(points[nodes[8 + n]] - points[[nodes[a], nodes[b]]].mean(axis=0)).max() for n, (a, b) in enumerate(edges))


back = meshio.read("cell.e")
reader = vtkExodusIIReader()
reader.SetFileName("cell.e")
reader.Update()
grid = reader.GetOutput().GetBlock(0).GetBlock(0)
nodes = [grid.GetCell(0).GetPointId(n) for n in range(20)]
here, there = off(back.points, back.cells[0].data[0]), off(vtk_to_numpy(grid.GetPoints().GetData()), nodes)
print(f"middles of edges off their place: read by meshio {here:.2f}, by VTK {there:.2f}")
assert here < 1e-12 and there > 0.4, "changed: the file has Exodus' order"
PYTHON
echo "as described: nodes of a 20-noded hexahedron stand in VTK's order in the Exodus file"
