#!/bin/sh
# Volume and mass of hexahedra and wedges in pyNastran 1.4.1 (`element.Volume()`, `mass_properties(model)`): the mean area of
# the first and the last face times the distance between their centres, along whatever slant it runs. One would expect the
# shape functions' integral, or at least a prism's area times height. A cube sheared by one edge: 1.414 for 1 (1.000 where
# its nodes are numbered from another side). A conical casing meshed along its axis: too heavy by the inverse cosine of its
# slope, 15 % at 30 degrees with 3,840 cells, however fine the mesh. A straight tube is right, and so are tetrahedra, so a
# trial on them does not show it. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pyNastran==1.4.1 numpy==1.26.4 scipy==1.15.3
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import math

import numpy as np
from pyNastran.bdf.bdf import BDF
from pyNastran.bdf.mesh_utils.mass_properties import mass_properties


def mass(cells, kind="add_chexa"):
    """Mass at density 1 of cells given by their corners."""
    model = BDF(debug=False)
    model.add_psolid(1, 1)
    model.add_mat1(1, 2e11, None, 0.3, rho=1.0)
    node = 0
    for number, corners in enumerate(cells, 1):
        for corner in corners:
            node += 1
            model.add_grid(node, corner)
        getattr(model, kind)(number, 1, list(range(node - len(corners) + 1, node + 1)))
    model.cross_reference()
    return float(mass_properties(model)[0])


def tube(slope, around, across, along):
    """Wall 10 mm thick (across the axis), 100 mm long, inner radius from 50 mm on; exact volume of the facetted body."""
    cells, sector = [], 2.0 * math.pi / around
    for layer, ring, cell in np.ndindex(along, across, around):
        corners = []
        for z in (layer, layer + 1):
            for r, a in ((ring, cell), (ring + 1, cell), (ring + 1, cell + 1), (ring, cell + 1)):
                radius = 0.05 + slope * 0.1 * z / along + 0.01 * r / across
                corners.append((radius * math.cos(a * sector), radius * math.sin(a * sector), 0.1 * z / along))
        cells.append(corners)
    middle = 0.05 + 0.5 * slope * 0.1 + 0.005
    return cells, around * math.sin(sector) * middle * 0.01 * 0.1


cube = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)], float)
sheared = cube + np.outer(cube[:, 2], (1.0, 0.0, 0.0))
seen = mass([cube]), mass([sheared]), mass([sheared[[0, 4, 5, 1, 3, 7, 6, 2]]]), mass([sheared[[0, 1, 2, 4, 5, 6]]], "add_cpenta")
tetrahedron = mass([sheared[[0, 1, 3, 4]]], "add_ctetra")
print("cube {:.3f}; sheared {:.3f}; the same, numbered from another side {:.3f}; half of it as a wedge {:.3f}".format(*seen))
print(f"its tetrahedron {tetrahedron:.4f}, to be {1 / 6:.4f}")
assert abs(seen[0] - 1.0) < 1e-9 and abs(seen[2] - 1.0) < 1e-9 and abs(tetrahedron - 1 / 6) < 1e-9
assert abs(seen[1] - math.sqrt(2.0)) < 1e-6 and abs(seen[3] - 0.5 * math.sqrt(2.0)) < 1e-6, "changed: sheared cells are right"
for degrees in (0, 30):
    for around, across, along in ((24, 2, 10), (48, 4, 20)):
        cells, exact = tube(math.tan(math.radians(degrees)), around, across, along)
        ratio = mass(cells) / exact
        print(f"casing of {degrees} degrees, {len(cells):,} cells: {100.0 * (ratio - 1.0):+.2f} %")
        assert abs(ratio * math.cos(math.radians(degrees)) - 1.0) < 0.01, "changed: the mass of a cone is right"
PYTHON
echo "as described: sheared solids weigh too much"
