#!/bin/sh
# A casing of four-noded and three-noded elements in an Abaqus deck: two *ELEMENT blocks, one element set, which is the
# usual way to name a part of mixed elements. meshio 5.3.5 counts the set's elements off the last block with that name and
# takes this many of every block: of 1,000 quadrilaterals beside 1 triangle the set holds the first quadrilateral. A set of
# sets (*ELSET of names) is read the same way, with the members of one block in place of all. Nothing is said.
# Seen: 1 of 1,000 and 1 of 1. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet meshio==5.3.5 numpy==2.2.6

"$folder/env/bin/python" - "$folder/casing.inp" <<'PYTHON'
import sys

import meshio

columns = 1001
nodes = [f"{row * columns + i + 1}, {i}., {row}., 0." for row in (0, 1) for i in range(columns)]
nodes.append(f"{2 * columns + 1}, {columns}., 0., 0.")
quadrilaterals = [f"{i + 1}, {i + 1}, {i + 2}, {columns + i + 2}, {columns + i + 1}" for i in range(columns - 1)]
triangle = f"{columns}, {columns}, {2 * columns + 1}, {2 * columns}"
with open(sys.argv[1], "w") as deck:
    deck.write("\n".join(["*NODE", *nodes, "*ELEMENT, TYPE=CPS4R, ELSET=CASING", *quadrilaterals, "*ELEMENT, TYPE=CPS3, ELSET=CASING", triangle, ""]))
mesh = meshio.read(sys.argv[1])
cells = {block.type: len(block) for block in mesh.cells}
held = {block.type: len(members) for block, members in zip(mesh.cells, mesh.cell_sets["CASING"])}
print("elements:", cells, "in the set:", held)
assert cells == {"quad": 1000, "triangle": 1}
assert held == {"quad": 1, "triangle": 1}, "changed: the set holds the elements of both blocks"
PYTHON
echo "as described: the set has lost 999 of its 1,001 elements"
