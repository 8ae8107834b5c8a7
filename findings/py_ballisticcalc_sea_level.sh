#!/bin/sh
# The air of py_ballisticcalc 3.1.1 by `Atmo.icao()`: at sea level its density is 0.04 % above the 1.2250 kg/m3 of the
# standard, and within 30 feet (9.1 m) of the station's height it is that density whatever the height. Above, it falls as
# the standard's does, so that it steps by 0.09 % at 30 feet: a trajectory below flies in other air than one above.
# Seen: 1.22552 kg/m3 at 0 and 9 m, 1.22443 at 9.3 m. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet py_ballisticcalc==3.1.1

"$folder/env/bin/python" - <<'PYTHON'
from py_ballisticcalc import Atmo

air, standard = Atmo.icao(), 1.2250


def density(height):
    ratio, _ = air.get_density_and_mach_for_altitude(height / 0.3048)
    return standard * ratio


for height in (0.0, 9.0, 9.3, 30.0):
    print(f"{height:5.1f} m: {density(height):.5f} kg/m3, standard {standard * (1 - 0.0065 * height / 288.15) ** 4.25588:.5f}")
assert density(0.0) == density(9.0), "changed: density falls with height within 30 feet"
assert 1.0003 < density(0.0) / standard < 1.0006, "changed: sea level has the standard's density"
assert 0.0008 < 1.0 - density(9.3) / density(9.0) < 0.0015, "changed: the jump at 30 feet"
PYTHON
echo "as described: density steps at 30 feet above the station"
