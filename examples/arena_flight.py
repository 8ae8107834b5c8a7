"""Data of an arena test flown by the library `flight` alone: no burst, no dolfinx, no case file.

`arena_test.csv` has the form in which such tests are recorded: number, mass and speed by polar zone and mass group,
with semicolons, as spreadsheets write it. The fragments of each event are drawn from it; together the events give the
expected density of hazardous fragments over distance, and the distance to keep.

Run it: `python examples/arena_flight.py [FOLDER]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import flight
from flight.arena import ArenaTable
from flight.hazard import Criteria

TABLE = Path(__file__).resolve().parent / "arena_test.csv"
EVENTS = 20


def main(folder: Path) -> Path:
    """Fly the events; the picture's path."""
    folder.mkdir(parents=True, exist_ok=True)
    table = ArenaTable.read(TABLE)
    print(table)

    criteria = Criteria()  # 79 J, 1 per 55.7 m2
    events = [table.realisation(seed=1, number=number, position=(0.0, 0.0, 1.0)) for number in range(EVENTS)]
    result = flight.fly(events[0], witnesses=[flight.Cylinder(radius=10.0, bottom=0.0, top=3.0, name="screens")])
    print(result)
    print(f"fastest at the screens: {result.hits_on('screens')['speed'].max():.0f} m/s")
    expected = flight.hazard_distance(events, criteria, by="all")  # one upright round: all azimuths are alike
    print(f"hazard distance: {expected.distance:.0f} m, upper bound (95 %) {expected.upper:.0f} m")

    figure = Figure(figsize=(7.4, 5.6), layout="constrained")
    launch, density = figure.subplots(2, 1)
    zones = table.by_zone(criteria.energy)
    middle = 0.5 * (zones["from_deg"] + zones["to_deg"])
    width = zones["to_deg"] - zones["from_deg"]
    launch.bar(middle, zones["number"], width, color="#b8c4d4", edgecolor="white", label="all")
    launch.bar(middle, zones["hazardous"], width, color="#16365c", edgecolor="white", label="79 J or more at launch")
    launch.set(xlabel="Angle from the nose (degrees)", ylabel="Fragments in the zone", xlim=(0.0, 180.0))
    launch.legend()
    part = np.maximum(expected.density[1] / criteria.density, 1e-4)
    density.semilogy(expected.radius, part, color="#16365c", label=f"{EVENTS} events")
    density.axhline(1.0, color="#8b95a1", linewidth=0.8)
    label = f"hazard distance {expected.distance:.0f} m"
    density.axvline(expected.distance, color="#c4601d", linestyle="--", label=label)
    density.axvline(expected.upper, color="#b3361e", label=f"upper bound (95 %) {expected.upper:.0f} m")
    density.set(xlabel="Distance (m)", ylabel="Hazardous fragments\nper 55.7 m$^2$")
    density.set(xlim=(0.0, 400.0), ylim=(1e-3, None))
    density.legend()
    picture = folder / "arena_flight.png"
    figure.savefig(picture, dpi=150)
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/arena_flight")))
