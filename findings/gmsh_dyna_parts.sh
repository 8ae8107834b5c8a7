#!/bin/sh
# Physical groups of gmsh 4.15.2 in an LS-DYNA deck (.key): the part of an element is the number of its geometric volume
# plus 3,000,000, not its group's, a group of two volumes is two parts, and the comments "PhysicalVolume11" name volume 1
# twice and no group. Sets of nodes by group, where asked for, count 1, 2, ... in place of the groups' numbers. The same
# model as .inp names the groups. Whoever gives materials by the groups' numbers has charge and casing without any.
# Seen: parts 3000001 to 3000003 for groups 40 (two volumes) and 50. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet gmsh==4.15.2

"$folder/env/bin/python" - "$folder" <<'PYTHON'
import sys

import gmsh

gmsh.initialize()
gmsh.option.setNumber("General.Terminal", 0)
model = gmsh.model
boxes = [(3, model.occ.addBox(x, 0, 0, 1, 1, 1)) for x in range(3)]
model.occ.fragment(boxes[:1], boxes[1:])
model.occ.synchronize()
for dimension, tag in model.getEntities():
    if dimension == 1:
        model.mesh.setTransfiniteCurve(tag, 2)
    if dimension == 2:
        model.mesh.setTransfiniteSurface(tag)
        model.mesh.setRecombine(2, tag)
    if dimension == 3:
        model.mesh.setTransfiniteVolume(tag)
model.addPhysicalGroup(3, [1, 3], 40, "casing")
model.addPhysicalGroup(3, [2], 50, "charge")
model.mesh.generate(3)
gmsh.option.setNumber("Mesh.SaveGroupsOfElements", 1)
gmsh.option.setNumber("Mesh.SaveGroupsOfNodes", 1)
rows = {}
for ending in ("key", "inp"):
    gmsh.write(f"{sys.argv[1]}/model.{ending}")
    rows[ending] = [row.strip() for row in open(f"{sys.argv[1]}/model.{ending}")]
gmsh.finalize()

parts = [int(row.split(",")[1]) for row in rows["key"] if row.count(",") == 9]
sets = [rows["key"][i + 2] for i, row in enumerate(rows["key"]) if row == "*SET_NODE_LIST"]
names = [row for row in rows["inp"] if row.startswith("*ELSET")]
print("key: parts", parts, "sets of nodes", sets, [row for row in rows["key"] if "SET_ELEMENT" in row])
print("inp:", names)
assert parts == [3000001, 3000002, 3000003] and sets == ["1", "2"], "changed: parts or sets are numbered by their groups"
assert not any(row.startswith(("*SET_SOLID", "*PART")) for row in rows["key"])
assert names == ["*ELSET,ELSET=casing", "*ELSET,ELSET=charge"]
PYTHON
echo "as described: parts of the deck are geometric volumes"
