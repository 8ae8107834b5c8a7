"""Published mean masses as the laws need them: casing, speed, and the mean of Mott's law through what was measured."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from transition.law.mean_mass import equivalent_cylinder, gurney_coefficient, gurney_speed
from validation.runs import reference_beside

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

__all__ = [
    "REFERENCE",
    "Casing",
    "Fit",
    "above_a_cut",
    "fit_numbers",
    "fit_shells",
    "from_recovery",
    "measured",
]

REFERENCE = reference_beside(__file__)
_OUNCE, _POUND, _GRAIN, _FOOT = 28.349523125e-3, 0.45359237, 64.79891e-6, 0.3048
_STEEL, _TNT, _TNT_DETONATION = 7850.0, 1580.0, 6880.0  # cast TNT as in TP-12, Table 1


@dataclass(frozen=True)
class Casing:
    """A casing whose fragments were counted. SI units.

    Attributes
    ----------
    name, source : what it is, and the key of its source in reference.toml.
    geometry : casings of one geometry share it: they count once in the scatter.
    outer_diameter, wall, inner_diameter : of the cylinder that has the diameter and the ratio of charge to metal.
    density, explosive, speed : of the metal; the filling; the initial speed of the fragments.
    mean : mean fragment mass of Mott's law in two dimensions (kg) through what was measured.
    """

    name: str
    source: str
    geometry: str
    outer_diameter: float
    wall: float
    inner_diameter: float
    density: float
    explosive: str
    speed: float
    mean: float


@dataclass(frozen=True)
class Fit:
    """Mott's law N0 exp(-sqrt(m/mu)) through points: mean 2 mu (kg), N0, and the rms of ln N about it."""

    mean: float
    number: float
    rms: float


def fit_numbers(mass: Sequence[float], number: Sequence[float]) -> Fit:
    """Least squares of ln N over sqrt(m), all points alike; `mass` in kg."""
    root, logarithm = np.sqrt(np.asarray(mass)), np.log(np.asarray(number, dtype=float))
    slope, intercept = np.polyfit(root, logarithm, 1)
    rms = float(np.sqrt(np.mean((logarithm - intercept - slope * root) ** 2)))
    return Fit(2.0 / slope**2, math.exp(intercept), rms)


def above_a_cut(average: float, cut: float) -> float:
    """Mean (kg) of all pieces of a Mott law whose pieces above `cut` (kg) have the mean `average` (kg).

    Above the mass c the law has the mean c + 2 sqrt(mu c) + 2 mu.
    """
    root = 0.5 * (-math.sqrt(cut) + math.sqrt(2.0 * average - cut))
    return 2.0 * root**2


def from_recovery(number: float, recovered: float, metal: float) -> float:
    """Mean (kg) of all pieces of a Mott law that holds the `metal` and leaves `number` pieces of `recovered` (kg).

    With x = sqrt(c/mu), c the lightest piece recovered, the share exp(-x) (1 + x + x^2/2) of the metal and exp(-x) of
    the pieces lie above c.
    """
    low, high = 0.0, 10.0
    for _ in range(100):  # the share falls with x
        x = 0.5 * (low + high)
        low, high = (x, high) if math.exp(-x) * (1.0 + x + 0.5 * x * x) > recovered / metal else (low, x)
    return metal * math.exp(-low) / number


def measured() -> list[Casing]:
    """All casings of reference.toml."""
    casings = [_shell(table, _points(table).mean) for table in REFERENCE["shell"]]
    pit = REFERENCE["pit"]
    metal = _POUND * pit["masses_lb"]["casing"]
    casings.append(_shell(pit, from_recovery(pit["number"], _POUND * pit["recovered_lb"], metal)))
    cylinder = REFERENCE["cylinder"]
    outer, inner = (1e-3 * cylinder[f"{side}_diameter_mm"] for side in ("outer", "inner"))
    for charge in cylinder["charge"]:
        ratio = charge["density"] * inner**2 / (_STEEL * (outer**2 - inner**2))
        mean = above_a_cut(_GRAIN * charge["average_grain"], _GRAIN * cylinder["cut_grain"])
        speed = gurney_speed(charge["detonation_velocity"], ratio)
        name, geometry = f"cylinder, {charge['explosive']}", "cylinder"
        wall = 0.5 * (outer - inner)
        casings.append(
            Casing(name, cylinder["source"], geometry, outer, wall, inner, _STEEL, charge["explosive"], speed, mean)
        )
    return casings


def fit_shells() -> dict[str, Fit]:
    """Mott's law through the points of every shell's tables, by the shell's name."""
    return {table["name"]: _points(table) for table in REFERENCE["shell"]}


def _points(table: Mapping[str, Any]) -> Fit:
    ounces = [*table["lightest_oz"], *table.get("perforating_oz", [])]
    return fit_numbers([_OUNCE * m for m in ounces], [*table["number"], *table.get("perforating_number", [])])


def _shell(table: Mapping[str, Any], mean: float) -> Casing:
    """A shell by its calibre and ratio of charge to metal; where masses are not known, that which gives the speed."""
    diameter, speed = 1e-3 * table["outer_diameter_mm"], _FOOT * table["initial_speed_ft_s"]
    if "masses_lb" in table:
        ratio = table["masses_lb"]["charge"] / table["masses_lb"]["casing"]
    else:
        ratio = 1.0 / ((gurney_coefficient(_TNT_DETONATION) / speed) ** 2 - 0.5)
    wall, inner = equivalent_cylinder(diameter, ratio, _STEEL, _TNT)
    return Casing(
        table["name"], table["source"], table["name"].removesuffix(", pit"), diameter, wall, inner, _STEEL, "TNT",
        speed, mean,
    )  # fmt: skip
