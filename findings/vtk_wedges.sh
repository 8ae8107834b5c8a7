#!/bin/sh
# Wedges (six nodes, VTK_WEDGE) have another order of nodes in VTK 9.7.2 than up to 9.6 (here 9.5.2): the normal of the first
# triangle now points into the cell, as in other finite element formats and in VTK's own wedges of higher order; before it
# pointed out. The files do not say which order they hold (.vtk is version 5.1 and .vtu 1.0 or 0.1 with both), so a file of the
# one release is read by the other without a word, and each of its wedges is inside out. meshio 5.3.5, which exchanges nodes for
# the old order, now writes inverted wedges for 9.7 and reads those of 9.7 inverted.
# One would expect the volume of a file's cell to stay, or a new version of the format. Seen: vtkCellSizeFilter gives -0.5 for
# 0.5; faces' normals point inwards; integrals over wedges count against those over hexahedra. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
for version in 9.5.2 9.7.2; do
    python3 -m venv "$folder/$version"
    "$folder/$version/bin/pip" install --quiet vtk==$version meshio==5.3.5 numpy==2.2.6
done
cd "$folder"
cat > wedges.py <<'PYTHON'
"""wedges.py write|read: writes a right wedge of this VTK and meshio, or reads all such files."""
import sys
from glob import glob

import meshio
import numpy as np
import vtkmodules.all as vtk

VERSION = vtk.vtkVersion.GetVTKVersion()
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], dtype=float)


def volume(grid):
    sizes = vtk.vtkCellSizeFilter()
    sizes.SetInputData(grid)
    sizes.Update()
    return sizes.GetOutput().GetCellData().GetArray("Volume").GetValue(0)


def wedge(order):
    grid, points = vtk.vtkUnstructuredGrid(), vtk.vtkPoints()
    for corner in CORNERS:
        points.InsertNextPoint(*corner)
    grid.SetPoints(points)
    grid.InsertNextCell(vtk.VTK_WEDGE, 6, order)
    return grid


def gap(cells):
    """Volume (m3) by the order of other formats: the first triangle's normal points to the second triangle."""
    a, b, c, d = CORNERS[cells[0][[0, 1, 2, 3]]]
    return 0.5 * np.cross(b - a, c - a) @ (d - a)


if sys.argv[1] == "write":
    both = [[0, 1, 2, 3, 4, 5], [0, 2, 1, 3, 5, 4]]
    right = [order for order in both if volume(wedge(order)) > 0.0]
    assert right == [both[1 if VERSION == "9.5.2" else 0]], "changed: another order of a wedge's nodes"
    for kind, writer in (("vtu", vtk.vtkXMLUnstructuredGridWriter()), ("vtk", vtk.vtkUnstructuredGridWriter())):
        writer.SetFileName(f"{VERSION}.{kind}")
        writer.SetInputData(wedge(right[0]))
        writer.Write()
        meshio.Mesh(CORNERS, [("wedge", both[:1])]).write(f"meshio.{kind}")
else:
    for name in sorted(glob("*.vt[uk]")):
        reader = vtk.vtkXMLUnstructuredGridReader() if name.endswith("u") else vtk.vtkUnstructuredGridReader()
        reader.SetFileName(name)
        reader.Update()
        found, other = volume(reader.GetOutput()), gap(meshio.read(name).cells[0].data)
        print(f"file of {name}: volume {found:+.2f} by VTK {VERSION}, {other:+.2f} by the nodes that meshio reads")
        old = not name.startswith("9.7")
        assert found == (0.5 if old == (VERSION == "9.5.2") else -0.5), "changed: files say their order"
        assert other == (0.5 if old else -0.5), "changed: meshio takes the new order"
PYTHON
for act in write read; do
    for version in 9.5.2 9.7.2; do "$folder/$version/bin/python" wedges.py $act; done
done
head -1 9.5.2.vtk 9.7.2.vtk
test "$(head -1 9.5.2.vtk)" = "$(head -1 9.7.2.vtk)"
test "$(grep -a -o '<VTKFile[^>]*version="[^"]*"' 9.5.2.vtu)" = "$(grep -a -o '<VTKFile[^>]*version="[^"]*"' 9.7.2.vtu)"
echo "as described: wedges of VTK 9.5 and 9.7 have different nodes and the same format"
