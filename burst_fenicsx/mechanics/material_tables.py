"""What the kernels know of the materials: a row of numbers for each part of each round."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError
from burst_fenicsx.kernels.cells.layout import CHARGE_OWN, SOLID_OWN
from burst_fenicsx.materials import laws
from burst_fenicsx.materials.products import number_of
from burst_fenicsx.problem import CasingMaterial, Part

if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType

    from burst_fenicsx.materials.products import Products
    from burst_fenicsx.problem import BurstSettings, Round


FUZE = CasingMaterial(
    name="fuze",
    density=3000.0,
    elastic_modulus=70e9,
    poisson_ratio=0.33,
    shear_strength=150e6,
    tensile_strength=300e6,
    source="a light alloy standing in for the fuze; its density is set from the fuze's mass",
)
"""What fills the cavity in front of the charge: inert, weaker than the casing."""


def density_of_fuze(item: Round) -> float:
    """Density (kg/m3) of what fills a round's fuze, by its mass where the profile has one."""
    density = item.profile.fuze_density if item.profile is not None else 0.0
    return density if density > 0.0 else FUZE.density


def largest_pressure(item: Round) -> float:
    """Bound on the stresses (Pa) that fix how finely forces are rounded.

    Four times the Chapman-Jouguet pressure of gamma = 3, and a quarter of the casing's modulus of compression in one
    direction, which two plates of steel reach that meet at about 4 km/s.
    """
    nu = item.casing.poisson_ratio
    plane = item.casing.elastic_modulus * (1.0 - nu) / ((1.0 + nu) * (1.0 - 2.0 * nu))
    return max(item.explosive.density * item.explosive.detonation_velocity**2, 0.25 * plane)


def material_tables(
    rounds: Sequence[Round], settings: BurstSettings, products: Sequence[Products], fuze_density: Sequence[float]
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Parameters of the solid and the charge kernel and the densities, one row for each part of each round."""
    rows = len(Part) * len(rounds)
    solid = np.zeros((rows, SOLID_OWN + max(len(law.PARAMETERS) for law in laws("solids"))))
    charge = np.zeros((rows, CHARGE_OWN + max(len(model.PARAMETERS) for model in laws("products"))))
    density = np.zeros(rows)
    viscosity, hourglass = settings.viscosity, settings.hourglass
    for index, item in enumerate(rounds):
        row = len(Part) * index
        for part, material, rho in (
            (Part.CASING, item.casing, item.casing.density),
            (Part.FUZE, FUZE, fuze_density[index]),
        ):
            density[row + part] = rho
            number, law = _law_of(material)
            solid[row + part, :SOLID_OWN] = (
                material.elastic_modulus,
                material.poisson_ratio,
                rho,
                viscosity.linear,
                viscosity.quadratic,
                hourglass.casing_viscous,
                hourglass.casing_stiffness,
                number,
            )
            solid[row + part, SOLID_OWN : SOLID_OWN + len(law.PARAMETERS)] = law.constants(material)
        own = products[index].parameters
        charge[row + Part.CHARGE, : CHARGE_OWN + len(own)] = *_charge_row(item, settings, products[index]), *own
        density[row + Part.CHARGE] = item.explosive.density
    return solid, charge, density


def fastest_signal(solid: np.ndarray, products: Sequence[Products], rounds: Sequence[Round]) -> float:
    """The fastest (m/s) that anything comes on in the rounds at rest: fronts, and plane waves in metal."""
    modulus, poisson, density = solid[solid[:, 2] > 0.0, :3].T
    waves = np.sqrt(modulus * (1.0 - poisson) / ((1.0 + poisson) * (1.0 - 2.0 * poisson) * density))
    fronts = [
        max(model.front_speed, item.explosive.detonation_velocity) for model, item in zip(products, rounds, strict=True)
    ]
    return float(max(waves.max(initial=0.0), *fronts))


def _law_of(material: CasingMaterial) -> tuple[int, ModuleType]:
    for number, law in enumerate(laws("solids")):
        if type(material) is law.MATERIAL:
            return number, law
    raise InputError(f"material '{material.name}': no law is known for a {type(material).__name__}")


def _charge_row(item: Round, settings: BurstSettings, model: Products) -> tuple[float, ...]:
    explosive = item.explosive
    by_compression = 1.0 / (1.0 - model.cj_volume) if settings.burn == "time_or_compression" else 0.0
    return (
        explosive.density,
        explosive.density * explosive.known("sound_speed") ** 2,
        explosive.shear_modulus,
        explosive.shear_strength,
        settings.viscosity.linear,
        settings.viscosity.quadratic,
        settings.hourglass.charge_viscous,
        explosive.detonation_velocity,
        by_compression,
        explosive.hugoniot_slope,
        explosive.hugoniot_limit,
        number_of(settings.products),
    )
