"""Flight and atmosphere beside py_ballisticcalc and RocketPy, with what is theirs distinguished from what is ours.

Our air is held against the printed standard, and theirs shown beside ours: what differs there is theirs. Flights with
a constant coefficient are flown by us in the other program's own air too: there both integrate one equation, and the
solutions must agree. What differs in the standard's air, and with a table of the coefficient, is shown.
"""

from __future__ import annotations

import json
import subprocess
import venv
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import numpy as np

import flight
from flight.scene.air import EARTH_RADIUS, STANDARD_GRAVITY, AirTable
from validation.runs import StudyError, reference_beside

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray

    from flight.scene.air import Air
    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "peer_answers", "study"]

REFERENCE = reference_beside(__file__)
STARTS = {"py_ballisticcalc": 0.0, "rocketpy": 1.0}
"""Heights at which the programs launch (m): RocketPy ends a flight that begins on the ground."""
STEP, TOP = 1.0, 1500.0  # m, of the altitudes at which another program's air is taken: one of them jumps at 9 m


@dataclass(frozen=True)
class SampledAir:
    """Air of another program: linear between its values at altitudes 0, STEP, ... (m)."""

    altitude: NDArray[np.float64]
    values: tuple[NDArray[np.float64], NDArray[np.float64]]

    def density(self, height: ArrayLike) -> NDArray[np.float64]:
        """Density (kg/m3) at heights z (m)."""
        return np.interp(height, self.altitude, self.values[0])

    def sound_speed(self, height: ArrayLike) -> NDArray[np.float64]:
        """Speed of sound (m/s) at heights z (m)."""
        return np.interp(height, self.altitude, self.values[1])

    def table(self) -> AirTable:
        """What the kernels read, in geopotential height."""
        edges = np.arange(0.0, TOP, STEP)
        height = EARTH_RADIUS * edges / (EARTH_RADIUS - edges)
        pieces = np.zeros((len(edges) - 1, 8))
        for column, value in ((0, self.density(height)), (4, 1.0 / self.sound_speed(height))):
            pieces[:, column], pieces[:, column + 1] = value[:-1], np.diff(value) / STEP
        return AirTable(0.0, STEP, pieces, 0.0)


def study(runs: Runs, rows: Rows) -> None:  # noqa: ARG001 - nothing is burst
    """Ask the peers, then compare."""
    air, allowed = REFERENCE["air"], REFERENCE["allowed"]
    fine = np.arange(0.0, TOP + 0.5 * STEP, STEP)
    constant, table = ([0.0, 5.0], [1.0, 1.0]), (REFERENCE["mach"], REFERENCE["table"])
    answers = peer_answers([*air["altitude"], *fine], [constant, table])
    ours = flight.StandardAtmosphere()
    for name, unit, value in (
        ("density", "kg/m3", ours.density(air["altitude"])),
        ("sound_speed", "m/s", ours.sound_speed(air["altitude"])),
    ):
        words = name.replace("_", " of ") if name == "density" else "speed of sound"
        for index, altitude in enumerate(air["altitude"]):
            where = f"{words} at {altitude / 1000.0:g} km"
            rows.verify(where, value[index], air[name][index], allowed["air"], air["source"], unit)
            for program, answer in answers.items():
                rows.compare(f"{where}, beside {program}", value[index], answer[name][index],
                             f"{program} {answer['version']}", unit)  # fmt: skip
    for program, answer in answers.items():
        start, source = STARTS[program], f"{program} {answer['version']}"
        sampled = [np.array(answer[name][len(air["altitude"]) :]) for name in ("density", "sound_speed")]
        theirs = SampledAir(fine, (sampled[0], sampled[1]))
        for kind, (drag, same) in enumerate(((1.0, theirs), (flight.Drag(*map(np.array, table)), None))):
            for index, one in enumerate(REFERENCE["flights"]):
                place, _, speed = answer["flights"][kind * len(REFERENCE["flights"]) + index]
                name = f"{1e3 * one[0]:g} g, {one[1]:g} m/s, {one[2]:g} degrees, after {one[3]:g} s"
                if same is not None:
                    at, fast = fly(*one, start, drag, same)
                    rows.verify(f"{name}: distance, in {program}'s air", at, place, allowed["same_air"], source, "m")
                    rows.verify(f"{name}: speed, in {program}'s air", fast, speed, allowed["same_air"], source, "m/s")
                at, _ = fly(*one, start, drag, ours)
                how = "constant coefficient" if kind == 0 else "table of the coefficient"
                rows.compare(f"{name}: distance, {how}, beside {program}", at, place, source, "m")


def fly(
    mass: float, speed: float, elevation: float, time: float, height: float, drag: flight.Drag | float, air: Air
) -> tuple[float, float]:
    """Horizontal distance (m) and speed (m/s) of a fragment at a time."""
    angle = np.radians(elevation)
    launch = speed * np.array([np.cos(angle), 0.0, np.sin(angle)])
    one = flight.Fragments(mass, (0.0, 0.0, height), launch, REFERENCE["shape_factor"])
    end = flight.fly(one, drag=drag, air=air, ground=None, time_limit=time, threads=1).landing[0]
    return float(end["position"][0]), float(end["speed"])


def peer_answers(
    altitudes: Sequence[float], drags: Sequence[tuple[Sequence[float], Sequence[float]]]
) -> dict[str, Any]:
    """Air and flights of the peers by their names, from an environment of their own in a temporary folder.

    Raises StudyError: they cannot be installed, or end with an error.
    """
    problem = {
        "altitudes": list(altitudes), "drags": drags, "flights": REFERENCE["flights"], "starts": STARTS,
        "shape_factor": REFERENCE["shape_factor"], "gravity": STANDARD_GRAVITY,
    }  # fmt: skip
    with TemporaryDirectory() as folder:
        venv.create(folder, with_pip=True)
        python = Path(folder, "bin", "python")
        _run([str(python), "-m", "pip", "install", "--quiet", *REFERENCE["packages"]], folder)
        script = Path(__file__).with_name("their_flights.py")
        output = _run([str(python), "-I", str(script)], folder, json.dumps(problem))
    answers: dict[str, Any] = json.loads(output.splitlines()[-1])
    return answers


def _run(command: Sequence[str], folder: str, problem: str = "") -> str:
    done = subprocess.run(command, cwd=folder, input=problem, capture_output=True, text=True, check=False)
    if done.returncode:
        raise StudyError(f"{' '.join(command)}: {done.stderr[-2000:]}")
    return done.stdout
