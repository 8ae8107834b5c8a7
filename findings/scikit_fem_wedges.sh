#!/bin/sh
# Integrals over wedges in scikit-fem 12.0.2 (`MeshWedge1`, `ElementWedge1`, any `intorder`): half of the volume, with points of
# which some lie outside the cell. The rule is built of one line and two triangles, where a wedge is one triangle and one line. One
# would expect weights that sum to the wedge's volume, and polynomials up to the stated order to be exact.
# Seen, a unit cube of two wedges: volume, mass and stiffness 0.5 for 1; a single wedge 0.25 for 0.5, its centre of mass at
# (0.50, 0.33, 0.33) for (0.33, 0.33, 0.50). In a steady solution under a constant load per volume the factor cancels, so a trial
# on that hardly shows it. Hexahedra and tetrahedra are right. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet scikit-fem==12.0.2 numpy==2.3.5 scipy==1.16.3
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

import numpy as np
from skfem import (
    Basis, ElementHex1, ElementTetP1, ElementWedge1, MeshHex, MeshTet, MeshWedge1, asm,
)
from skfem.models.poisson import laplace, mass

print("scikit-fem", version("scikit-fem"))
CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (0, 1, 1)], dtype=float).T
for name, mesh, element, right, seen in (
    ("cube of a hexahedron", MeshHex(), ElementHex1(), 1.0, 1.0),
    ("cube of tetrahedra", MeshTet(), ElementTetP1(), 1.0, 1.0),
    ("cube of two wedges", MeshWedge1(), ElementWedge1(), 1.0, 0.5),
    ("one wedge", MeshWedge1(CORNERS, np.arange(6)[:, None]), ElementWedge1(), 0.5, 0.25),
):
    for order in (1, 2, 5):
        basis = Basis(mesh, element, intorder=order)
        places = np.asarray(basis.global_coordinates())
        volume = basis.dx.sum()
        centre = np.einsum("cij,ij->c", places, basis.dx) / volume
        heights = mesh.p[2]
        stiffness = heights @ asm(laplace, basis) @ heights
        weight = asm(mass, basis).sum()
        print(f"{name}, order {order}: volume {volume:.4f}, mass {weight:.4f}, stiffness along z {stiffness:.4f}, to be {right}; "
              f"centre {centre.round(3)}")
        assert np.allclose([volume, weight, stiffness], seen, atol=1e-9), f"changed: {name}"
    if name == "one wedge":
        outside = basis.X[0] + basis.X[1] > 1.0
        print(f"points of order {order} outside of the wedge: {outside.sum()} of {outside.size}")
        assert outside.any() and np.allclose(centre, (1.0 / 2.0, 1.0 / 3.0, 1.0 / 3.0), atol=1e-6), "changed: points of the rule"
PYTHON
echo "as described: integrals over wedges are halved"
