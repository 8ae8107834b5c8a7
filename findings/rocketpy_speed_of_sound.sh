#!/bin/sh
# RocketPy 1.13.0 computes the speed of sound of its standard atmosphere at the borders of the layers alone and goes in
# straight lines between them, while the temperature there is right: at 5.9 km it is 0.25 % below sqrt(1.4 R T) of its
# own temperature, 316.08 for 316.88 m/s, so that Mach numbers are as much too high. Its pages give sqrt(1.4 R T).
# Seen: 0, -0.14, -0.25, -0.21, -0.00 % at 0, 2, 5.9, 8, 11 km. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet rocketpy==1.13.0 numpy==2.4.6 scipy==1.17.1
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

from rocketpy import Environment

air = Environment()
air.set_atmospheric_model(type="standard_atmosphere")
errors = []
for altitude in (0.0, 2000.0, 5900.0, 8000.0, 11000.0):
    exact = (1.4 * air.air_gas_constant * air.temperature(altitude)) ** 0.5
    errors.append(round(100.0 * (air.speed_of_sound(altitude) / exact - 1.0), 2))
    print(f"{altitude:5.0f} m: {air.temperature(altitude):.2f} K, {air.speed_of_sound(altitude):.2f} m/s, {exact:.2f} by it")
print(f"rocketpy {version('rocketpy')}: {errors} %")
assert [abs(one) for one in errors] == [0.0, 0.14, 0.25, 0.21, 0.0], "the behaviour has changed"
PYTHON
