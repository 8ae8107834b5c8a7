"""Fragments over a hill and past a barricade, with `flight` alone: what the barricade stops, and where the rest lands.

The fragments are those of `arena_test.csv`, of a round that stands 1.5 m over level ground between a bank and a hill.
Run it: `python examples/terrain_and_barricade.py [FOLDER]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import flight
from flight.arena import ArenaTable

TABLE = Path(__file__).resolve().parent / "arena_test.csv"
REACH, STEP = 1000.0, 20.0  # m


def hill() -> flight.HeightMap:
    """A hill of 40 m to the east, on otherwise level ground."""
    line = np.arange(-REACH, REACH + STEP / 2.0, STEP)
    x, y = np.meshgrid(line, line)
    heights = 40.0 * np.exp(-(((x - 250.0) / 90.0) ** 2) - (y / 200.0) ** 2)
    return flight.HeightMap(heights, step=STEP, corner=(-REACH, -REACH), name="hill")


def main(folder: Path) -> Path:
    """Fly one event with and without hill and barricade; the picture's path."""
    folder.mkdir(parents=True, exist_ok=True)
    ground = hill()
    start = (0.0, 0.0, 1.5 + float(ground.at(0.0, 0.0)))
    fragments = ArenaTable.read(TABLE).realisation(seed=1, position=start)
    bank = flight.Barricade(start=(-12.0, -20.0), end=(-12.0, 20.0), height=4.0, name="bank")
    results = {
        "level ground": flight.fly(fragments, domain=flight.Domain(radius=REACH)),
        "hill and bank": flight.fly(fragments, ground=ground, obstacles=[bank]),
    }
    figure = Figure(figsize=(9.0, 4.8), layout="constrained")
    for axes, (name, result) in zip(figure.subplots(1, 2, sharex=True, sharey=True), results.items(), strict=True):
        print(f"{name}: {result}")
        landed = result.landed
        hazardous = landed["energy"] >= 79.0
        x, y = landed["position"][:, 0], landed["position"][:, 1]
        axes.plot(x[~hazardous], y[~hazardous], ".", markersize=2.0, color="#8b95a1", label="below 79 J")
        axes.plot(x[hazardous], y[hazardous], ".", markersize=3.0, color="#b3361e", label="79 J or more")
        axes.set(title=f"{name}: {int(hazardous.sum())} hazardous", xlabel="x (m)", aspect="equal")
        axes.set(xlim=(-500.0, 500.0), ylim=(-500.0, 500.0))
    figure.axes[0].set_ylabel("y (m)")
    figure.axes[0].legend(loc="lower left")
    line = ground.corner[0] + STEP * np.arange(ground.heights.shape[1])
    lines = figure.axes[1].contour(line, line, ground.heights, levels=[5, 10, 20, 30], colors="#9a8a1f", linewidths=0.7)
    figure.axes[1].clabel(lines, fontsize=6)
    figure.axes[1].plot(*np.transpose([bank.start, bank.end]), color="#6b4e16", linewidth=3.0)
    faces = {face["face"]: face["hits"] for face in results["hill and bank"].by_face()[0]["faces"]}
    print(f"hits on the bank by face: {faces}")
    picture = folder / "terrain_and_barricade.png"
    figure.savefig(picture, dpi=150)
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/terrain_and_barricade")))
