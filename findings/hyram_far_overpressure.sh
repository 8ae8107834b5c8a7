#!/bin/sh
# Overpressure far from a release by HyRAM 6.1, methods "tnt" and "bst" of `compute_overpressure`: it stops falling where the
# table ends (39.6 m/kg^(1/3), 2.4 kPa by TNT; 1.0 kPa by BST) and stays the same however far away, without a warning; one
# would expect it to go on falling, NaN, or a refusal. Asked for the distance to a lower pressure, `calc_distance_to_overpressure`
# answers with the end of the table: 1 kPa (broken panes) is put where there are 2.4 kPa, at about half of its distance.
# With a release whose centre lies off the leak the same function adds that offset twice: the pressure at the distance that
# it gives for 10 kPa is not 10 kPa. The Bauwens method falls as it should. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet hyram==6.1 scipy==1.16.3 numpy==2.3.5 CoolProp==7.2.0
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import numpy as np
from hyram.phys import api

air, hydrogen = api.create_fluid("AIR", temp=293.0, pres=101325.0), api.create_fluid("H2", temp=293.0, pres=35e6)
far = [np.array([distance, 0.0, 0.0]) for distance in (10.0, 100.0, 1000.0, 10000.0)]
for method in ("tnt", "bst", "bauwens"):
    found = api.compute_overpressure(
        method, far, air, hydrogen, 0.003, create_overpressure_plot=False, create_impulse_plot=False
    )["overpressures"]
    print(f"{method}: " + ", ".join(f"{pressure:.1f}" for pressure in found) + " Pa at 10, 100, 1,000, 10,000 m")
    if method == "bauwens":
        assert found[3] < 0.01 * found[1]
    else:
        assert found[1] == found[2] == found[3] > 500.0, "changed: the pressure falls on beyond the table"
jet = api.Jet(hydrogen, api.Orifice(0.003), air)
tnt = api.TNT_method(jet, 0.03, origin_at_orifice=True)
ends = [float(tnt.calc_distance_to_overpressure(pressure)) for pressure in (2000.0, 1000.0, 100.0)]
print("distance to 2, 1 and 0.1 kPa: " + ", ".join(f"{distance:.2f}" for distance in ends) + " m")
assert ends[0] == ends[1] == ends[2], "changed: distances to pressures below the table differ"
off = api.TNT_method(jet, 0.03)
distance = float(off.calc_distance_to_overpressure(10e3))
there = float(off.calc_overpressure([np.array([distance, off.origin[1], 0.0])])[0])
print(f"centre {off.origin[0]:.2f} m from the leak: 10 kPa at {distance:.2f} m, where the pressure is {there / 1e3:.1f} kPa")
assert abs(there / 10e3 - 1.0) > 0.1, "changed: the offset of the centre is counted once"
PYTHON
echo "as described: the pressure stays the same beyond the table"
