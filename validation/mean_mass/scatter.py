"""What every law gives for the measured casings, and how its ratio to the measured mean scatters.

Casings of one geometry, such as the cylinder with nine fillings, count once: their mean logarithm stands for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from transition.errors import InputError
from transition.law.mean_mass import explosive_constant, gurney_sarmousakis, mott_1947, mott_linfoot, ruptured
from transition.settings import BreakUpSettings

if TYPE_CHECKING:
    from collections.abc import Sequence

    from validation.mean_mass.data import Casing

__all__ = ["LAWS", "Scatter", "computed", "ratios", "scatter"]

LAWS = ("mott", "mott_1947", "gurney_sarmousakis")
_SETTINGS = BreakUpSettings()


@dataclass(frozen=True)
class Scatter:
    """Ratio of computed to measured mean mass over geometries.

    Attributes
    ----------
    geometries : int
        How many of them.
    bias : float
        Geometric mean of the ratio.
    deviation : float
        Its geometric standard deviation about the bias.
    factor : float
        The same about 1, bias included: exp of the root mean square of ln(ratio).
    worst, worst_ratio : str, float
        The geometry farthest from 1, and its ratio.
    """

    geometries: int
    bias: float
    deviation: float
    factor: float
    worst: str
    worst_ratio: float


def computed(law: str, casing: Casing) -> float:
    """Mean mass (kg) with the defaults of the break-up; NaN where the law has no constant for the explosive."""
    radius, wall = ruptured(0.5 * casing.outer_diameter, casing.wall, _SETTINGS.critical_strain)
    if law == "mott":
        return mott_linfoot(_SETTINGS.prefactor, casing.density, radius, _SETTINGS.fracture_energy, wall, casing.speed)
    if law == "mott_1947":
        rate = casing.speed / radius
        return mott_1947(casing.density, _SETTINGS.fracture_stress, _SETTINGS.fracture_gamma, wall, rate)
    try:
        constant = explosive_constant(casing.explosive, None)
    except InputError:
        return math.nan
    return gurney_sarmousakis(constant, casing.wall, casing.inner_diameter)


def ratios(law: str, casings: Sequence[Casing]) -> dict[str, float]:
    """Computed over measured mean mass by geometry (geometric mean over its casings)."""
    logarithms: dict[str, list[float]] = {}
    for casing in casings:
        found = computed(law, casing) / casing.mean
        if math.isfinite(found):
            logarithms.setdefault(casing.geometry, []).append(math.log(found))
    return {geometry: math.exp(sum(values) / len(values)) for geometry, values in logarithms.items()}


def scatter(law: str, casings: Sequence[Casing]) -> Scatter:
    """Bias and scatter of a law over all geometries."""
    found = ratios(law, casings)
    logarithms = np.log(list(found.values()))
    worst = max(found, key=lambda name: abs(math.log(found[name])))
    return Scatter(
        len(found),
        math.exp(logarithms.mean()),
        math.exp(logarithms.std(ddof=1)),
        math.exp(math.sqrt(float(np.mean(logarithms**2)))),
        worst,
        found[worst],
    )
