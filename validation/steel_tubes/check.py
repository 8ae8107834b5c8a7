"""Rows of the long steel tubes: speed of the middle against Gurney's formula."""

from __future__ import annotations

from dataclasses import dataclass
from math import sqrt
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validation.files import reference_beside, snapshot_of
from validation.rows import Row, compare, within

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

__all__ = ["NAME", "REFERENCE", "Along", "along", "check", "gurney_speed", "gurney_velocity", "outer_radius"]

NAME = "steel_tubes"
REFERENCE = reference_beside(__file__)


@dataclass(frozen=True, eq=False)
class Along:
    """Speeds along a tube at the end of its burst.

    Attributes
    ----------
    place : (n,) float64
        Stations over the length, from the initiated end.
    speed : (n,) float64
        Mass-weighted mean speed of the wall at each (m/s).
    mass : (n,) float64
        Mass of the wall at each (kg).
    """

    place: NDArray[Any]
    speed: NDArray[Any]
    mass: NDArray[Any]

    def mean(self, low: float, high: float) -> float:
        """Mass-weighted mean speed (m/s) between two shares of the length."""
        inside = (self.place >= low) & (self.place <= high)
        return float(self.speed[inside] @ self.mass[inside] / self.mass[inside].sum())


def along(snapshot: Path) -> Along:
    """Read the speeds off burst_snapshot.h5; raises StudyError where it is none."""
    with snapshot_of(snapshot) as file:
        rows, length = file["rounds/0/along"][()], float(file["rounds/0"].attrs["length"])
    filled = rows["casing_mass"] > 0.0
    return Along(rows["station"][filled] / length, rows["mean_speed"][filled], rows["casing_mass"][filled])


def outer_radius(bore_radius: float, charge_ratio: float, explosive_density: float, casing_density: float) -> float:
    """Outer radius at which a full tube has the mass ratio C/M of charge to casing, in the unit of the bore's."""
    return bore_radius * sqrt(1.0 + explosive_density / (casing_density * charge_ratio))


def gurney_velocity() -> float:
    """sqrt(2E) of TNT (m/s): the middle of the printed values."""
    low, high = REFERENCE["gurney"]
    return 0.5 * (low + high)


def gurney_speed(velocity: float, charge_ratio: float) -> float:
    """Speed of a long cylinder's wall (m/s) by Gurney's formula, from sqrt(2E) (m/s) and C/M."""
    return velocity / sqrt(1.0 / charge_ratio + 0.5)


def check(
    charge_ratio: float, speeds: Along, burst: Mapping[str, Any], label: str = "", *, verdict: bool = True
) -> list[Row]:
    """Compare one tube with Gurney's formula.

    Parameters
    ----------
    charge_ratio : C/M that the tube was to have.
    speeds : along the tube.
    burst : the burst's part of summary.json. The comparison is void if the wall still accelerates, or if the meshed
        tube has another C/M.
    label : what was computed; left out: the charge ratio.
    verdict : whether the speed of the middle judges or only informs.
    """
    label = label or f"C/M {charge_ratio:g}"
    tolerance = REFERENCE["allowed"]["speed"] if verdict else None
    done = float(burst["acceleration_complete"] is not None)
    found = burst["charge_mass"] / burst["casing_mass"]
    sound = [
        within(NAME, f"{label}: acceleration complete", done, 1.0, 1.0, "own bound"),
        within(NAME, f"{label}: mass ratio as meshed", found, 0.99 * charge_ratio, 1.01 * charge_ratio, "own bound"),
    ]
    if not all(row.passed for row in sound):
        return sound
    wanted = gurney_speed(gurney_velocity(), charge_ratio)
    source = REFERENCE["source"]
    middle = speeds.mean(*REFERENCE["middle"])
    return [
        *sound,
        compare(NAME, f"{label}: speed of the middle", middle, wanted, tolerance, source, "m/s"),
        compare(NAME, f"{label}: fastest station", float(speeds.speed.max()), wanted, None, source, "m/s"),
        compare(NAME, f"{label}: whole tube, ends included", speeds.mean(0.0, 1.0), wanted, None, source, "m/s"),
    ]
