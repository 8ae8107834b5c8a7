#!/bin/sh
# Volumes and areas of elements in exovista 1.3.0 (Exodus files for PyVista), `compute_element_volumes(file, block)`:
# - wedges of six nodes: minus six times the volume, the sum over three tetrahedra without the factor;
# - triangles: half of x0 y1 - x1 y0, the area with the origin in place of the third corner, so it depends on where the
#   triangle lies;
# - shells of four nodes: the area of their shadow on the plane of x and y, 0 for a wall.
# One would expect the size of the element. Of hexahedra and tetrahedra it is right, so a trial on those does not show it; lengths
# and volumes of nodes (`compute_element_length`, `compute_node_volumes`) and the weights of means over triangles follow from it.
# Seen: wedge -3.0 for 0.5, the same triangle 0.5 at one place and 1.5 at another, wall 0 for 1. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet exovista==1.3.0 pyvista==0.49.1 vtk==9.5.2
cd "$folder"
"$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import exovista
import numpy as np
import pyvista

CUBE = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], dtype=float)
TRIANGLE = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0)], dtype=float)
CELLS = {  # kind of VTK's cell, corners, size to be, size seen
    "hexahedron": (12, CUBE, 1.0, 1.0),
    "tetrahedron": (10, CUBE[[0, 1, 3, 4]], 1.0 / 6.0, 1.0 / 6.0),
    "wedge": (13, CUBE[[0, 1, 3, 4, 5, 7]], 0.5, -3.0),
    "triangle at the origin": (5, TRIANGLE[[1, 2, 0]], 0.5, 0.5),
    "triangle at (2, 3)": (5, TRIANGLE + (2.0, 3.0, 0.0), 0.5, 1.5),
    "floor": (9, CUBE[[0, 1, 2, 3]], 1.0, 1.0),
    "wall": (9, CUBE[[0, 1, 5, 4]], 1.0, 0.0),
}
print("exovista", version("exovista"))
for number, (name, (kind, corners, right, seen)) in enumerate(CELLS.items()):
    grid = pyvista.UnstructuredGrid(np.r_[len(corners), np.arange(len(corners))], [kind], corners)
    grid.cell_data["region"] = [0]
    surface = grid.extract_surface()
    surface.cell_data["region"] = np.zeros(surface.n_cells, int)
    exovista.write_exo(f"{number}.exo", grid, surface)
    file = exovista.File(f"{number}.exo")
    block = file.get_element_block_ids()[0]
    found = float(exovista.compute_element_volumes(file, block)[0])
    print(f"{name} ({file.get_element_block(block).elem_type}): {found:.4f}, to be {right:.4f}")
    assert abs(found - seen) < 1e-6, f"changed: size of a {name}"
PYTHON
echo "as described: sizes of wedges and shells are wrong"
