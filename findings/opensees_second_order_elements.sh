#!/bin/sh
# Elements of second order in OpenSees 3.8.0 (openseespy):
# - `TenNodeTetrahedron` is six times too soft and six times too light: a bar of them, stretched by 0.1 %, pulls with a sixth of the
#   force. One would expect what `FourNodeTetrahedron` and `stdBrick` give to the last digit, since stress is uniform.
#   Frequencies are right, since the factor cancels, and so are displacements where displacements are prescribed.
# - `quad8n`, masses of the nodes: lumped by rows, so the corners have -1/12 of the mass each; `tri6n`: the corners have none.
#   The total is right. One would expect a consistent matrix, as of `bbarQuad`, or positive masses: with these explicit
#   integration diverges or divides by zero, and what a load throws off at a corner goes against the force.
# Nodes 9 and 10 of the tetrahedron are the middles of edges 3-4 and 2-4. With VTK's or gmsh's order of nodes the mass even
# is 0, without an error. Needs Linux on x86-64. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet openseespy==3.8.0.0 numpy==2.3.5
cd "$folder"
"$folder/env/bin/python" - 2>"$folder/said" <<'PYTHON' || { cat "$folder/said"; exit 1; }
import itertools

import numpy as np
import openseespy.opensees as ops

YOUNG, DENSITY, STRAIN, THICKNESS = 200e9, 7850.0, 1e-3, 0.1
CORNERS = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
BRICK = [0, 1, 3, 2, 4, 5, 7, 6]
EDGES = ((0, 1), (1, 2), (0, 2), (0, 3), (2, 3), (1, 3))
print("OpenSees", ops.version())


def tetrahedra():
    """Six tetrahedra of the unit cube, along the ways from corner 0 to corner 7, with positive volumes."""
    for steps in itertools.permutations((1, 2, 4)):
        cell = [0, steps[0], steps[0] + steps[1], 7]
        a, b, c, d = CORNERS[cell]
        yield cell if np.cross(b - a, c - a) @ (d - a) > 0.0 else [cell[i] for i in (1, 0, 2, 3)]


def build(points, cells, kind, *values):
    size = len(points[0])
    ops.wipe()
    ops.model("basic", "-ndm", size, "-ndf", size)
    for number, point in enumerate(points, 1):
        ops.node(number, *map(float, point))
    ops.nDMaterial("ElasticIsotropic", 1, YOUNG, 0.0, DENSITY)
    for number, cell in enumerate(cells, 1):
        ops.element(kind, number, *(int(node) + 1 for node in cell), *values)


def masses(size):
    """Mass matrix in the first direction (kg)."""
    ops.wipeAnalysis()
    ops.constraints("Plain")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.integrator("GimmeMCK", 1.0, 0.0, 0.0)
    ops.algorithm("Linear")
    ops.analysis("Transient", "-noWarnings")
    ops.analyze(1, 0.0)
    side = ops.systemSize()
    return np.array(ops.printA("-ret")).reshape(side, side)[::size, ::size]


def pull(points):
    """Force (N) at which the bar along the first axis is stretched."""
    ops.wipeAnalysis()
    ops.timeSeries("Constant", 1)
    ops.pattern("Plain", 1, 1)
    for number, point in enumerate(points, 1):
        for direction, value in enumerate(point, 1):
            if value == 0.0 or (direction == 1 and value == 1.0):
                ops.sp(number, direction, STRAIN * float(value))
    ops.constraints("Transformation")
    ops.numberer("Plain")
    ops.system("FullGeneral")
    ops.integrator("LoadControl", 1.0)
    ops.algorithm("Linear")
    ops.analysis("Static", "-noWarnings")
    assert ops.analyze(1) == 0
    ops.reactions()
    return sum(ops.nodeReaction(number, 1) for number, point in enumerate(points, 1) if point[0] == 1.0)


linear = list(tetrahedra())
points, cells, known = [tuple(corner) for corner in CORNERS], [], {}
for cell in linear:
    nodes = list(cell)
    for pair in EDGES:
        ends = tuple(sorted(cell[i] for i in pair))
        if ends not in known:
            known[ends] = len(points)
            points.append(tuple(CORNERS[list(ends)].mean(axis=0)))
        nodes.append(known[ends])
    cells.append(nodes)
for kind, places, which, right in (
    ("stdBrick", CORNERS, [BRICK], 1.0), ("FourNodeTetrahedron", CORNERS, linear, 1.0),
    ("TenNodeTetrahedron", points, cells, 1.0 / 6.0),
):
    build(places, which, kind, 1)
    mass = masses(3).sum() / DENSITY
    build(places, which, kind, 1)
    force = pull(places) / (YOUNG * STRAIN)
    print(f"{kind}: force {force:.4f} and mass {mass:.4f} of the right ones")
    assert abs(force - right) < 1e-4 and abs(mass - right) < 1e-4, f"changed: {kind}"
build(points, [[cell[i] for i in (0, 1, 2, 3, 4, 5, 6, 7, 9, 8)] for cell in cells], "TenNodeTetrahedron", 1)
print(f"TenNodeTetrahedron, nodes in VTK's order: mass {masses(3).sum() / DENSITY:.4f} of the right one")
assert abs(masses(3).sum()) < 1e-6 * DENSITY

flat = np.array([(0, 0), (1, 0), (1, 1), (0, 1)], dtype=float)
for kind, corners, value in (("quad8n", flat, -1.0 / 12.0), ("tri6n", flat[[0, 1, 3]], 0.0)):
    nodes = np.vstack([corners, 0.5 * (corners + np.roll(corners, -1, axis=0))])
    build(nodes, [range(len(nodes))], kind, THICKNESS, "PlaneStrain", 1)
    matrix = masses(2)
    share = np.diag(matrix) / matrix.sum()
    print(f"{kind}: nodes' shares of the mass {share.round(4)}")
    assert np.allclose(matrix, np.diag(np.diag(matrix)), atol=1e-9) and np.allclose(share[: len(corners)], value), "changed"
PYTHON
echo "as described: second order elements of OpenSees"
