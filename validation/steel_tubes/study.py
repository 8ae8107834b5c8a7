"""Long steel tubes: the speed of the middle over the charge ratio, against Gurney's formula."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from typing import TYPE_CHECKING, Any

from validation.runs import ROOT, reference_beside, snapshot_of

if TYPE_CHECKING:
    from pathlib import Path

    from numpy.typing import NDArray

    from validation.rows import Rows
    from validation.runs import Runs

__all__ = ["REFERENCE", "Along", "along", "gurney_speed", "outer_radius", "study", "tube_of"]

REFERENCE = reference_beside(__file__)
SIZE, QUICK_SIZE = "3 mm", "6 mm"


def study(runs: Runs, rows: Rows) -> None:
    """Burst a tube for every charge ratio and compare its middle with Gurney's formula."""
    low, high = REFERENCE["gurney"]
    meshed, complete, ratios = [], 0, REFERENCE["quick_charge_ratios" if rows.quick else "charge_ratios"]
    for ratio in ratios:
        size = QUICK_SIZE if rows.quick else SIZE
        folder, burst = runs.burst(f"steel_tubes_{ratio:g}", REFERENCE["case"], size, tube_of(ratio))
        meshed.append(burst["charge_mass"] / burst["casing_mass"] / ratio)
        if burst["acceleration_complete"] is None:
            continue  # the wall's speed is not the last one
        complete += 1
        tube = along(folder / "burst_snapshot.h5")
        wanted = gurney_speed(0.5 * (low + high), ratio)
        rows.compare(f"C/M {ratio:g}: speed of the middle", tube.mean(*REFERENCE["middle"]), wanted,
                     REFERENCE["source"], "m/s")  # fmt: skip
    rows.bound(f"tubes whose acceleration is complete, of {len(ratios)}", complete, (len(ratios), len(ratios)),
               "Gurney's speed is the last one")  # fmt: skip
    worst = max(meshed, key=lambda one: abs(one - 1.0))
    rows.verify("mass ratio as meshed over that asked for, the worst", worst, 1.0, 0.01, "the drawing")


@dataclass(frozen=True, eq=False)
class Along:
    """Stations (n,) over the length from the initiated end, mean speed of the wall (m/s) and its mass (kg) at each."""

    station: NDArray[Any]
    speed: NDArray[Any]
    mass: NDArray[Any]

    def mean(self, low: float, high: float) -> float:
        """Mass-weighted mean speed (m/s) between two fractions of the length."""
        inside = (self.station >= low) & (self.station <= high)
        return float(self.speed[inside] @ self.mass[inside] / self.mass[inside].sum())


def along(snapshot: Path) -> Along:
    """Read the speeds off burst_snapshot.h5; raises StudyError where it is none."""
    with snapshot_of(snapshot) as file:
        rows, length = file["rounds/0/along"][()], float(file["rounds/0"].attrs["length"])
    filled = rows["casing_mass"] > 0.0
    return Along(rows["station"][filled] / length, rows["mean_speed"][filled], rows["casing_mass"][filled])


def gurney_speed(velocity: float, charge_ratio: float) -> float:
    """Speed of a long cylinder's wall (m/s) by Gurney's formula, from sqrt(2E) (m/s) and C/M."""
    return velocity / sqrt(1.0 / charge_ratio + 0.5)


def outer_radius(bore_radius: float, charge_ratio: float, explosive_density: float, casing_density: float) -> float:
    """Outer radius at which a full tube has the mass ratio C/M of charge to casing, in the unit of the bore's."""
    return bore_radius * sqrt(1.0 + explosive_density / (casing_density * charge_ratio))


def tube_of(charge_ratio: float) -> dict[str, Any]:
    """Changes of the case that give the tube this mass of charge over that of steel."""
    from fragfield.case import load_case
    from fragfield.case.conversion.rounds import burst_rounds

    (item,) = burst_rounds(load_case(ROOT / REFERENCE["case"]))
    profile = item.profile
    assert profile is not None  # the case gives its contours
    bore = 1e3 * float(profile.cavity.radius(0.0))
    outer = outer_radius(bore, charge_ratio, item.explosive.density, item.casing.density)
    return {"round.*.profile.outer.points": [[0.0, outer], [1e3 * profile.length, outer]]}
