#!/bin/sh
# Equivalent strain and nodes out of order in ccx2paraview 3.2.0 (CalculiX results, .frd, to ParaView):
# - `E_Mises` of total strain is made by the formula of stress, so it is 1.5 times the equivalent strain, the root of
#   2/3 of the deviator's square: a bar drawn out by 10 % without change of volume shows 15 %. Against a strain at fracture
#   (0.12 here) the bar has failed and has not. ParaView's own formulas and PEEQ beside it are right.
# - nodes that do not stand in ascending order in the file, which the format allows: coordinates are kept in the file's
#   order and values given in ascending order, so each value stands at another node, without a word.
# Seen: 0.15 for 0.10; the node at x = 0 moves by 0.4 mm for 0.1 mm. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet ccx2paraview==3.2.0 vtk==9.5.2 numpy==2.2.6
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import math
from pathlib import Path

import numpy as np
from ccx2paraview import Converter
from vtkmodules.util.numpy_support import vtk_to_numpy
from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

PLACES = {1: (0.0, 0.0, 0.0), 2: (1.0, 0.0, 0.0), 3: (0.0, 1.0, 0.0), 4: (0.0, 0.0, 1.0)}
STRAIN = (0.1, -0.05, -0.05, 0.0, 0.0, 0.0)
MOVED = {1: 0.1, 2: 0.2, 3: 0.3, 4: 0.4}


def convert(name, order):
    """A tetrahedron with displacements and total strains, its nodes listed in an order."""
    def block(title, parts, values):
        rows = [f"  100CL  101{1.0:12.5E}{4:12d}{'':20}{0:2d}{1:5d}{'':10}{1:2d}", f" -4  {title:8}{len(parts):5d}{1:5d}"]
        rows += [f" -5  {part:8}{1:5d}{2:5d}{number:5d}{0:5d}" for number, part in enumerate(parts, 1)]
        return rows + [f" -1{node:10d}" + "".join(f"{value:12.5E}" for value in values(node)) for node in order] + [" -3"]

    lines = ["    1C", f"    2C{'':18}{4:12d}{'':37}{1:1d}"]
    lines += [f" -1{node:10d}" + "".join(f"{x:12.5E}" for x in PLACES[node]) for node in order]
    lines += [" -3", f"    3C{'':18}{1:12d}{'':37}{1:1d}", f" -1{1:10d}{3:5d}{0:5d}{1:5d}", " -2" + "".join(f"{n:10d}" for n in (1, 2, 3, 4)), " -3"]
    lines += block("DISP", ("D1", "D2", "D3"), lambda node: (MOVED[node], 0.0, 0.0))
    lines += block("TOSTRAIN", ("EXX", "EYY", "EZZ", "EXY", "EYZ", "EZX"), lambda node: STRAIN)
    Path(f"{name}.frd").write_text("\n".join([*lines, " 9999", ""]))
    Converter(f"{name}.frd", ["vtu"]).run()
    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(f"{name}.vtu")
    reader.Update()
    grid = reader.GetOutput()
    values = {grid.GetPointData().GetArrayName(n): vtk_to_numpy(grid.GetPointData().GetArray(n)) for n in range(grid.GetPointData().GetNumberOfArrays())}
    origin = int(np.abs(vtk_to_numpy(grid.GetPoints().GetData())).sum(axis=1).argmin())
    return values, float(values["U"][origin, 0])


values, moved = convert("up", (1, 2, 3, 4))
mises = float(values["E_Mises"][0])
tensor = np.diag(STRAIN[:3])
deviator = tensor - np.trace(tensor) / 3.0 * np.eye(3)
right = math.sqrt(2.0 / 3.0 * float((deviator * deviator).sum()))
print(f"equivalent strain {mises:.3f}, to be {right:.3f}; the node at the origin moves by {moved:.1f}, to be {MOVED[1]}")
assert abs(right - 0.1) < 1e-12 and abs(moved - MOVED[1]) < 1e-6
assert abs(mises - 0.15) < 1e-6, "changed: the equivalent strain is right"
moved = convert("down", (4, 3, 2, 1))[1]
print(f"with nodes in descending order it moves by {moved:.1f}")
assert abs(moved - MOVED[4]) < 1e-6, "changed: values stand at their nodes"
PYTHON
echo "as described: equivalent strain is 1.5 times too large, values follow ascending numbers"
