"""Run by the environment of the peers alone: their air and their flights as JSON, for the problem on stdin."""

from __future__ import annotations

import json
import math
import sys
import warnings
from importlib.metadata import version

warnings.simplefilter("ignore")


def ballisticcalc(problem: dict) -> dict:
    """Air and flights of py_ballisticcalc."""
    from py_ballisticcalc import Ammo, Angular, Atmo, Calculator, Distance, DragModel, Shot, Velocity, Weight

    air = Atmo.icao()
    found = [air.get_density_and_mach_for_altitude(z / 0.3048) for z in problem["altitudes"]]
    flights = []
    for drag in problem["drags"]:
        for mass, speed, elevation, time in problem["flights"]:
            area = (mass / problem["shape_factor"]) ** (2.0 / 3.0)
            diameter = Distance.Meter(math.sqrt(4.0 * area / math.pi))
            pounds, inches = Weight.Gram(1e3 * mass) >> Weight.Pound, diameter >> Distance.Inch
            model = DragModel(
                pounds / inches**2, [{"Mach": one, "CD": other} for one, other in zip(*drag, strict=True)]
            )
            shot = Shot(ammo=Ammo(model, Velocity.MPS(speed)), relative_angle=Angular.Degree(elevation), atmo=air)
            engine = Calculator(
                engine="scipy+dop853", config={"relative_tolerance": 1e-10, "absolute_tolerance": 1e-10}
            )
            result = engine.fire(
                shot, Distance.Meter(5000.0), Distance.Meter(1.0), time_step=1e-3, raise_range_error=False
            )
            at = result.get_at("time", time)
            flights.append([at.distance >> Distance.Meter, at.height >> Distance.Meter, at.velocity >> Velocity.MPS])
    return {
        "density": [1.225 * ratio for ratio, _ in found],
        "sound_speed": [0.3048 * one for _, one in found],
        "flights": flights,
    }


def rocketpy(problem: dict) -> dict:
    """Air and flights of RocketPy."""
    from rocketpy import EmptyMotor, Environment, Flight, PointMassRocket

    air = Environment(gravity=problem["gravity"])
    air.set_atmospheric_model(type="standard_atmosphere")
    flights = []
    for drag in problem["drags"]:
        for mass, speed, elevation, time in problem["flights"]:
            area = (mass / problem["shape_factor"]) ** (2.0 / 3.0)
            table = [list(pair) for pair in zip(*drag, strict=True)]
            # drag acts along the body's axis, which a large coefficient keeps along the velocity
            rocket = PointMassRocket(math.sqrt(area / math.pi), mass, 0.0, table, table, weathercock_coeff=1e4)
            rocket.add_motor(EmptyMotor(), position=0.0)
            angle, half = math.radians(elevation), 0.5 * math.radians(90.0 - elevation)
            start = [
                0.0,
                0.0,
                0.0,
                problem["starts"]["rocketpy"],
                speed * math.cos(angle),
                0.0,
                speed * math.sin(angle),
            ]
            turn = [math.cos(half), 0.0, math.sin(half), 0.0, 0.0, 0.0, 0.0]
            flight = Flight(
                rocket,
                air,
                rail_length=1e-3,
                initial_solution=start + turn,
                simulation_mode="3 DOF",
                rtol=1e-9,
                atol=[1e-9] * 13,
                max_time=time + 1.0,
            )
            flights.append([flight.x(time), flight.z(time) - problem["starts"]["rocketpy"], flight.speed(time)])
    return {
        "density": [float(air.density(z)) for z in problem["altitudes"]],
        "sound_speed": [float(air.speed_of_sound(z)) for z in problem["altitudes"]],
        "flights": [list(map(float, one)) for one in flights],
    }


if __name__ == "__main__":
    asked = json.load(sys.stdin)
    answers = {"py_ballisticcalc": ballisticcalc(asked), "rocketpy": rocketpy(asked)}
    for name, answer in answers.items():
        answer["version"] = version(name)
    print("\n" + json.dumps(answers))
