#!/bin/sh
# The air of ballistics-engine 0.48.0, `AtmosphericConditions(temperature_f, pressure_inhg, humidity_percent, altitude_feet)`:
# above sea level a measured temperature of exactly 59 degrees Fahrenheit is replaced by the standard's of that height, and a
# pressure of exactly 29.92 inches likewise, each by itself, since these are the defaults and stand for "not given". One would
# expect the numbers that were given, as at 58.8 or 29.9, and a result that is continuous in them.
# Seen, at 5,000 feet, speed of a bullet after 1,000 yards: 1317 feet/s at 58.8 and at 59.2 degrees, 1286 at 59; 1139 at 29.90
# and 1137 at 29.95 inches, 1302 at 29.92. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet ballistics-engine==0.48.0
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

from ballistics_engine import AtmosphericConditions, BallisticInputs, DragModel, TrajectorySolver


def speed(**air):
    """Speed (feet/s) after 1,000 yards in some air at 5,000 feet."""
    inputs = BallisticInputs(
        bc=0.505, bullet_weight_grains=168, muzzle_velocity_fps=2650, bullet_diameter_inches=0.308,
        bullet_length_inches=1.24, sight_height_inches=1.5, zero_distance_yards=100, twist_rate_inches=11.25,
    )
    inputs.drag_model = DragModel.g1()
    result = TrajectorySolver(inputs, atmosphere=AtmosphericConditions(altitude_feet=5000, **air)).solve()
    assert round(result.max_range_yards) == 1094
    return result.impact_velocity_fps


print("ballistics-engine", version("ballistics-engine"))
warm = {value: speed(temperature_f=value, pressure_inhg=24.9) for value in (41.2, 58.8, 59.0, 59.2)}
dense = {value: speed(temperature_f=50.0, pressure_inhg=value) for value in (24.9, 29.9, 29.92, 29.95)}
for name, values in (("degrees Fahrenheit", warm), ("inches of mercury", dense)):
    print(f"{name}:", ", ".join(f"{value:g} {found:.1f} feet/s" for value, found in values.items()))
assert 0.0 < warm[59.2] - warm[58.8] < 1.0 and 0.0 < dense[29.9] - dense[29.95] < 2.0
assert abs(warm[59.0] - warm[41.2]) < 0.5 and warm[58.8] - warm[59.0] > 30.0, "changed: 59 degrees are taken as given"
assert abs(dense[29.92] - dense[24.9]) < 0.5 and dense[29.92] - dense[29.9] > 160.0, "changed: 29.92 inches are taken as given"
PYTHON
echo "as described: values of the standard atmosphere count as not given"
