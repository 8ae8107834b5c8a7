"""A round of one's own contour, built in Python: an ogive from its formula, checked by its masses, then burst.

The picture shows the contour and, below it, the casing's speed along the round beside Gurney's formula for the local
charge ratio, which has no end effects. Run it: `python examples/own_profile.py [FOLDER]`.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

import fragfield

LENGTH, CALIBRE = 420.0, 105.0  # mm
OGIVE = 180.0  # mm of the nose that are curved
WALL = 12.0  # mm


def contour() -> dict[str, object]:
    """The profile as a case file has it: points of half the section, from the nose end."""
    station = np.linspace(0.0, OGIVE, 13)
    radius = 0.5 * CALIBRE
    tip = 12.0
    # A tangent ogive: a circle that is level where the cylinder begins.
    rise = radius - tip
    circle = (OGIVE**2 + rise**2) / (2.0 * rise)
    height = radius - circle + np.sqrt(circle**2 - (OGIVE - station) ** 2)
    outer = np.vstack([np.column_stack([station, height]), [[LENGTH, radius]]])
    inside = station > 40.0
    inner = np.column_stack([station[inside], np.maximum(height[inside] - WALL, 4.0)])
    cavity = np.vstack([inner, [[LENGTH - 25.0, radius - WALL]]])
    return {
        "unit": "mm",
        "source": "made up for this example",
        "outer": {"points": outer.round(3)},
        "cavity": {"points": cavity.round(3)},
        "charge": {"front": float(inner[0, 0].round(3))},
    }


def main(folder: Path) -> Path:
    """Compute the round into a folder; the picture's path."""
    profile = contour()
    case = fragfield.Case(
        title="A 105 mm round of its own contour",
        burst={"cell_size": "7 mm", "end_time": "100 us", "convergence": "off"},
        round=[
            {
                "name": "own",
                "profile": profile,
                "explosive": "comp_b",
                "casing": "steel_m107",
                "position": ["0 m", "0 m", "1 m"],
            }
        ],
        hazard={"tolerance": 0.05},
    )
    (found,) = fragfield.check(case).found.rounds
    print(f"casing {found.casing_mass:.2f} kg, charge {found.charge_mass:.2f} kg")
    run = fragfield.run(case, out=folder / "run", overwrite=True)
    print(run.burst)
    print(run.hazard)

    along = run.table("along")
    present = along["casing_mass"] > 0.0
    figure = Figure(figsize=(7.4, 5.2), layout="constrained")
    shape, speed = figure.subplots(2, 1, sharex=True)
    for name, color in (("outer", "#16365c"), ("cavity", "#c4601d")):
        points = np.asarray(profile[name]["points"])
        for sign in (1.0, -1.0):
            shape.plot(points[:, 0], sign * points[:, 1], color=color, label=name if sign > 0.0 else None)
    shape.set(ylabel="Radius (mm)", aspect="equal")
    shape.legend(loc="center")
    speed.plot(along["station"][present] * 1e3, along["mean_speed"][present], "o-", color="#16365c", label="computed")
    for segment in found.segments:
        if segment.gurney_speed:
            ends = np.array([segment.start, segment.end]) * 1e3
            speed.plot(ends, [segment.gurney_speed] * 2, "--", color="#c4601d")
    speed.plot([], [], "--", color="#c4601d", label="Gurney, by segment")
    speed.set(xlabel="Station from the nose (mm)", ylabel="Casing speed (m/s)", ylim=(0.0, None))
    speed.legend()
    picture = folder / "own_profile.png"
    figure.savefig(picture, dpi=150)
    return picture


if __name__ == "__main__":
    print("picture:", main(Path(sys.argv[1] if len(sys.argv) > 1 else "runs/examples/own_profile")))
