#!/bin/sh
# North and south in xarray-spatial 0.10.20, `aspect` (degrees clockwise from north, as documented) and `hillshade` of a height
# map whose rows are named by their y coordinates. One would expect north to be where y grows, which `aspect(...,
# method="geodesic")` does; both read it off the order of the rows instead, and by opposite rules:
# - rows from south to north, as NetCDF files commonly hold them: a slope that falls to the south has the aspect 0, north.
# - rows from north to south, as GeoTIFF holds them: `hillshade` with the sun in the south leaves that slope in the shade and
#   brightens the one behind the hill.
# So on no map do the two agree. East and west are right, and so are the magnitudes, so a trial on a slope to the east does not
# show it. Which side of a hill faces a round or a wind is turned over. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet xarray-spatial==0.10.20 xarray==2026.9.0 numpy==2.5.5 numba==0.68.1
cd "$folder"
"$folder/env/bin/python" -W ignore - <<'PYTHON'
from importlib.metadata import version

import numpy as np
import xarray as xr
from xrspatial import aspect, hillshade

LONGITUDE, METRES = np.linspace(10.0, 10.02, 21), 111_000.0
print("xarray-spatial", version("xarray-spatial"))
seen = {}
for rows, latitude in (("from north", np.linspace(60.02, 60.0, 21)), ("from south", np.linspace(60.0, 60.02, 21))):
    for side, sign in (("south", 1.0), ("north", -1.0)):
        heights = sign * 0.3 * METRES * np.repeat((latitude - 60.0)[:, None], 21, axis=1)
        degrees = xr.DataArray(heights, coords={"lat": latitude, "lon": LONGITUDE}, dims=("lat", "lon"))
        metric = xr.DataArray(heights, coords={"y": METRES * latitude, "x": METRES * LONGITUDE}, dims=("y", "x"))
        plain, geodesic = (float(one[10, 10]) for one in (aspect(metric), aspect(degrees, method="geodesic")))
        light = {azimuth: float(hillshade(metric, azimuth=azimuth, angle_altitude=25)[10, 10]) for azimuth in (0, 180)}
        seen[rows, side] = plain, geodesic, light[180] > light[0]
        print(f"rows {rows}, slope falls to the {side}: aspect {plain:.0f}, geodesic {geodesic:.0f}; hillshade with the sun "
              f"in the north {light[0]:.2f}, in the south {light[180]:.2f}")
assert all(round(seen[rows, side][1]) % 360 == {"south": 180, "north": 0}[side] for rows, side in seen)
assert [round(seen["from north", side][0]) for side in ("south", "north")] == [180, 0]
assert [round(seen["from south", side][0]) for side in ("south", "north")] == [0, 180], "changed: aspect goes by coordinates"
assert [seen["from south", side][2] for side in ("south", "north")] == [True, False]
assert [seen["from north", side][2] for side in ("south", "north")] == [False, True], "changed: hillshade of northern rows"
PYTHON
echo "as described: north is the order of rows"
