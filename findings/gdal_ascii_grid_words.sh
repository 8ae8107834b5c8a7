#!/bin/sh
# ESRI ASCII grids in GDAL 3.10.3 (rasterio 1.4.4): text in place of a height is read as far as it looks like
# one, or as 0, without an error or a warning: "two" and "-" become 0, "2O" (the letter) 2, and "1,500.5", a comma between
# thousands, 1.5, since a comma counts as the decimal sign. "far" in place of xllcorner is 0 as well, which lays the map at
# the origin, and a cellsize of -10 turns it over. A height map for a distance so gets a pit or another place unseen.
# A missing height or header key is refused. GDAL 3.6.2 (Debian 12) reads them alike. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet rasterio==1.4.4 numpy==2.4.6
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from pathlib import Path

import rasterio

HEAD = "ncols 3\nnrows 2\nxllcorner 1000\nyllcorner 5000\ncellsize 10\nNODATA_value -9999\n"


def read(body, head=HEAD):
    Path("map.asc").write_text(head + body)
    with rasterio.open("map.asc") as grid:
        return grid.read(1)[0].tolist(), grid.transform.c, grid.transform.a


for word, height in (("two", 0), ("-", 0), ("2O", 2), ("1,500.5", 1.5)):
    found = read(f"501 {word} 503\n504 505 506\n")[0]
    print(f"{word!r} is read as {found[1]:g}")
    assert found == [501, height, 503], "changed"
place = read("1 2 3\n4 5 6\n", HEAD.replace("1000", "far"))[1]
cell = read("1 2 3\n4 5 6\n", HEAD.replace("cellsize 10", "cellsize -10"))[2]
print(f"xllcorner 'far' is read as {place:g}, a cellsize of -10 as {cell:g}")
assert (place, cell) == (0.0, -10.0), "changed"
PYTHON
echo "as described: words are heights"
