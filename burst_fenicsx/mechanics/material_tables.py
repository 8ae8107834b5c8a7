"""What the kernels know of the materials: a row of numbers for each part of each round."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.cells import charge_pressure
from burst_fenicsx.kernels.cells import solid as solid_kernel
from burst_fenicsx.materials.products import JwlProducts
from burst_fenicsx.problem import CasingMaterial, Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from burst_fenicsx.materials.products import Products
    from burst_fenicsx.problem import BurstSettings, Round

__all__ = ["FUZE", "density_of_fuze", "largest_pressure", "material_tables"]

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
    solid = np.zeros((rows, len(solid_kernel.PARAMETERS)))
    charge = np.zeros((rows, len(charge_pressure.PARAMETERS)))
    density = np.zeros(rows)
    viscosity, hourglass = settings.viscosity, settings.hourglass
    for index, item in enumerate(rounds):
        row = len(Part) * index
        for part, material, rho in (
            (Part.CASING, item.casing, item.casing.density),
            (Part.FUZE, FUZE, fuze_density[index]),
        ):
            density[row + part] = rho
            solid[row + part] = (
                material.elastic_modulus,
                material.poisson_ratio,
                material.shear_strength,
                material.tensile_strength,
                _inverse(material.shear_softening_strain),
                _inverse(material.tensile_softening_strain),
                viscosity.linear,
                viscosity.quadratic,
                hourglass.casing_viscous,
                hourglass.casing_stiffness,
                rho,
            )
        charge[row + Part.CHARGE] = _charge_row(item, settings, products[index])
        density[row + Part.CHARGE] = item.explosive.density
    return solid, charge, density


def _charge_row(item: Round, settings: BurstSettings, model: Products) -> tuple[float, ...]:
    explosive = item.explosive
    by_compression = 1.0 / (1.0 - model.cj_volume) if settings.burn == "time_or_compression" else 0.0
    unreacted = explosive.density * explosive.sound_speed**2
    shared = (
        explosive.density,
        unreacted,
        explosive.shear_modulus,
        explosive.shear_strength,
        settings.viscosity.linear,
        settings.viscosity.quadratic,
        settings.hourglass.charge_viscous,
        explosive.detonation_velocity,
        by_compression,
    )
    if isinstance(model, JwlProducts):
        c = model.constants
        products = (1.0, 0.0, 0.0, 1.0, c.A, c.B, c.R1, c.R2, c.omega)
    else:
        isentrope = (model.initial_pressure, model.knee_pressure, model.knee_volume)
        products = (0.0, *isentrope, 0.0, 0.0, 1.0, 1.0, 0.0)
    return (*shared, *products, explosive.hugoniot_slope, explosive.hugoniot_limit)


def _inverse(limit: float | None) -> float:
    return 0.0 if limit is None else 1.0 / limit
