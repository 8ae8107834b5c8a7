#!/bin/sh
# A fragment as a point mass without thrust in RocketPy 1.13.0 (PointMassRocket, "3 DOF"): drag acts along the body's axis,
# not against the velocity, and `weathercock_coeff`, by default 0, leaves that axis where it was at the start. On a path
# that bends, drag then also lifts or pushes sideways: 10 g thrown at 45 degrees and 1,000 m/s land at three quarters of
# the distance of a point mass whose drag is against its velocity. With a coefficient of 100 the axis follows and the
# distance is right. A flight straight up is right with either.
# Seen: 183 m with 0, 242 m with 100. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet rocketpy==1.13.0 numpy==2.4.6 scipy==1.17.1
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import math

from rocketpy import EmptyMotor, Environment, Flight, PointMassRocket
from scipy.integrate import solve_ivp

MASS, SPEED, ANGLE = 0.01, 1000.0, math.radians(45.0)
AREA = (MASS / 2600.0) ** (2.0 / 3.0)
air = Environment(gravity=9.80665, latitude=0.0, longitude=0.0, elevation=0.0)
air.set_atmospheric_model(type="standard_atmosphere")


def landing(coefficient):
    body = PointMassRocket(
        radius=math.sqrt(AREA / math.pi), mass=MASS, center_of_mass_without_motor=0, power_off_drag=1.0,
        power_on_drag=1.0, **({} if coefficient is None else {"weathercock_coeff": coefficient}),
    )
    body.add_motor(EmptyMotor(), position=0)
    half = 0.5 * (0.5 * math.pi - ANGLE)
    start = [0, 0, 0, 1.0, SPEED * math.cos(ANGLE), 0, SPEED * math.sin(ANGLE), math.cos(half), 0, math.sin(half), 0, 0, 0, 0]
    flight = Flight(
        rocket=body, environment=air, rail_length=1e-3, initial_solution=start, simulation_mode="3 DOF", rtol=1e-9,
        atol=[1e-9] * 13, max_time=60,
    )
    return flight.x_impact


def motion(_, state):
    x, z, u, w = state
    drag = 0.5 * air.density(max(z, 0.0)) * AREA / MASS * math.hypot(u, w)
    return [u, w, -drag * u, -drag * w - 9.80665]


def ground(_, state):
    return state[1]


ground.terminal, ground.direction = True, -1
plain = solve_ivp(
    motion, (0.0, 60.0), [0.0, 1.0, SPEED * math.cos(ANGLE), SPEED * math.sin(ANGLE)], events=ground, rtol=1e-9, atol=1e-9
).y[0, -1]
found = landing(None), landing(100.0)
print(f"default {found[0]:.1f} m, coefficient 100 {found[1]:.1f} m, drag against the velocity {plain:.1f} m")
assert found[0] < 0.8 * plain, "changed: the default's drag is against the velocity"
assert abs(found[1] / plain - 1.0) < 0.02
PYTHON
echo "as described: by default drag keeps the direction of the start"
