#!/bin/sh
# One volume in two physical groups, which gmsh allows, in a mesh of format 4.1: the cell data "gmsh:physical" of meshio
# 5.3.5 hold the group that is listed first for the volume, and nothing says that there is a second; `cell_sets` hold
# both. Which of "casing" and "fuze" a cell is thus depends on the order of two numbers in the file.
# Seen: [1] and [2] for the same mesh. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet meshio==5.3.5 numpy==1.26.4
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from pathlib import Path

import meshio

MESH = """$MeshFormat
4.1 0 8
$EndMeshFormat
$PhysicalNames
2
3 1 "casing"
3 2 "fuze"
$EndPhysicalNames
$Entities
0 0 0 1
1 0 0 0 1 1 1 2 {first} {second} 0
$EndEntities
$Nodes
1 8 1 8
3 1 0 8
1
2
3
4
5
6
7
8
0 0 0
1 0 0
1 1 0
0 1 0
0 0 1
1 0 1
1 1 1
0 1 1
$EndNodes
$Elements
1 1 1 1
3 1 5 1
1 1 2 3 4 5 6 7 8
$EndElements
"""
found = []
for first, second in ((1, 2), (2, 1)):
    Path("mesh.msh").write_text(MESH.format(first=first, second=second))
    mesh = meshio.read("mesh.msh")
    groups = {name: len(mesh.cell_sets[name][0]) for name in ("casing", "fuze")}
    found.append((mesh.cell_data["gmsh:physical"][0].tolist(), groups))
    print(f"meshio {meshio.__version__}: groups {first} and {second}: gmsh:physical {found[-1][0]}, cells in sets {groups}")
both = {"casing": 1, "fuze": 1}
assert found == [([1], both), ([2], both)], "the behaviour has changed"
PYTHON
