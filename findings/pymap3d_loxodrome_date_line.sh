#!/bin/sh
# Rhumb lines in pymap3d 3.2.0, `lox.loxodrome_inverse` and `lox.departure`, where two longitudes lie more than 180 degrees
# apart as numbers (across the date line, or one of them in 0 to 360 degrees and the other not): the difference is not
# brought into plus or minus 180. One would expect 20 degrees between 170 and -170, as by MATLAB's functions that they follow,
# or a refusal. Seen: from (45, 170) to (46, -170) 26,573 km towards the west by south for 1,567 km towards the east; along
# the parallel of 45 degrees the difference is taken modulo 180 degrees, which is neither way round: 12,615 km for 1,577,
# and of 190 degrees 10. `vincenty.vdist` of the same library has both right. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet pymap3d==3.2.0 numpy==2.3.5 geographiclib==2.1
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import numpy as np
from geographiclib.geodesic import Geodesic
from pymap3d import lox
from pymap3d.vincenty import vdist

AXIS, SQUARE = 6378137.0, 0.0066943799901413165
POINTS, WEIGHTS = np.polynomial.legendre.leggauss(40)


def rhumb(start, end):
    """Length (m) and azimuth (degrees) of the shorter rhumb line, by quadrature along the meridian."""
    east = np.radians((end[1] - start[1] + 180.0) % 360.0 - 180.0)
    first, last = np.radians([start[0], end[0]])
    if first == last:
        radius = AXIS / np.sqrt(1.0 - SQUARE * np.sin(first) ** 2) * np.cos(first)
        return abs(east) * radius, 90.0 if east > 0.0 else 270.0
    latitude = 0.5 * (first + last) + 0.5 * (last - first) * POINTS
    weight = 0.5 * (last - first) * WEIGHTS
    bow = 1.0 - SQUARE * np.sin(latitude) ** 2
    meridian = AXIS * (1.0 - SQUARE) / bow**1.5
    arc = (weight * meridian).sum()
    isometric = (weight * meridian * np.sqrt(bow) / (AXIS * np.cos(latitude))).sum()
    return abs(arc) * np.hypot(1.0, east / isometric), np.degrees(np.arctan2(east, isometric)) % 360.0


for start, end, right in (
    ((45.0, 10.0), (46.0, 20.0), True),
    ((45.0, 10.0), (45.0, 20.0), True),
    ((45.0, 170.0), (46.0, -170.0), False),
    ((45.0, 170.0), (45.0, -170.0), False),
    ((45.0, 10.0), (45.0, 350.0), False),
    ((60.0, 10.0), (60.0, 200.0), False),
):
    length, azimuth = (float(value) for value in lox.loxodrome_inverse(*start, *end))
    true, towards = (float(value) for value in rhumb(start, end))
    shortest, vincenty = Geodesic.WGS84.Inverse(*start, *end)["s12"], float(vdist(*start, *end)[0])
    print(f"{start} to {end}: {length / 1e3:,.0f} km at {azimuth:.1f}, to be {true / 1e3:,.0f} at {towards:.1f}")
    assert abs(vincenty / shortest - 1.0) < 1e-6 and true >= shortest * (1.0 - 1e-9)
    if right:
        assert abs(length / true - 1.0) < 1e-6 and abs(azimuth - towards) < 1e-6
    else:
        assert abs(length / true - 1.0) > 0.5, "changed: longitudes are brought into one turn"
        # shorter than the shortest way there is, or the long way round, or neither
        print("  shorter than the geodesic" if length < shortest else f"  {length / true:.1f} times too long")
PYTHON
echo "as described: rhumb lines across the date line are wrong"
