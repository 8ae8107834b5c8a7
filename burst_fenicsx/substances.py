"""Explosives and casing materials in SI units; what stands at a field is its entry in the case reference."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Literal, get_args

from burst_fenicsx.errors import InputError
from fragfield_base.bounds import Bounds
from fragfield_base.inputs import Density, EnergyRange, PositivePressure, Pressure, Quantity, Speed

ProductModel = Literal["landau", "landau_cj", "jwl"]


@dataclass(frozen=True)
class JonesWilkinsLee:
    """Constants of the law of Jones, Wilkins and Lee: P over the relative volume V, with its own energy E.

    P = A (1 - omega/(R1 V)) exp(-R1 V) + B (1 - omega/(R2 V)) exp(-R2 V) + omega E/V.
    """

    A: Annotated[PositivePressure, Bounds(1e8, 1e13, "published A are 100 to 1200 GPa", usual=(1e10, 3e12))]
    """Pressure of the first exponential."""
    B: Annotated[
        float,
        Quantity("Pa", "3.231 GPa"),
        Bounds(-1e12, 1e12, "published B are -10 to 40 GPa", usual=(-3e10, 1e11)),
    ]
    """Pressure of the second exponential."""
    R1: Annotated[float, Bounds(0.5, 50.0, "published R1 are 3.5 to 7.5", usual=(3.0, 15.0))]
    """Rate of the first exponential."""
    R2: Annotated[float, Bounds(0.05, 20.0, "published R2 are 0.6 to 2", usual=(0.3, 3.0))]
    """Rate of the second exponential."""
    omega: Annotated[float, Bounds(0.01, 3.0, "published omega are 0.2 to 0.6", usual=(0.1, 1.0))]
    """Gruneisen coefficient."""
    E0: Annotated[
        float,
        Quantity("J/m^3", "7 GJ/m^3", above=0.0),
        Bounds(1e7, 1e11, "published E0 are 2 to 15 GJ/m^3", usual=(1e9, 2e10)),
    ]
    """Energy per initial volume."""


@dataclass(frozen=True, kw_only=True)
class Explosive:
    """An explosive with its constants.

    Shocks in the unreacted charge run at U = c0 + s u behind which matter moves at u: c0 is `sound_speed`, s
    `hugoniot_slope`.
    """

    name: str
    """What outputs call it."""
    density: Annotated[Density, Bounds(100.0, 5000.0, "densities of explosives", usual=(700.0, 2100.0))]
    """Density of the charge."""
    detonation_velocity: Annotated[Speed, Bounds(500.0, 1.2e4, "detonation fronts", usual=(2000.0, 1e4))]
    """Speed D of the steady detonation front."""
    heat_of_detonation: Annotated[
        float | None,
        Quantity("J/kg", "4.52 MJ/kg", above=0.0),
        Bounds(1e5, 3e7, "heats of explosives", usual=(1e6, 1e7)),
    ] = None
    """Heat Q of detonation; the Landau models need it, more than D^2 / 16."""
    sound_speed: Annotated[
        float | None,
        Quantity("m/s", "2570 m/s", above=0.0),
        Bounds(50.0, 1e4, "speeds of sound of explosives", usual=(500.0, 5000.0)),
    ] = None
    """Bulk sound speed of the unreacted charge: c0 of its shocks, U = c0 + s u. The burst needs it."""
    hugoniot_slope: Annotated[float, Bounds(1.0, 5.0, "published fits have 1.4 to 2.2", usual=(1.2, 2.6))] = 1.9
    """s of the same; published fits have 1.4 to 2.2."""
    shear_modulus: Annotated[PositivePressure, Bounds(1e4, 1e12, "moduli of solids", usual=(1e7, 2e10))] = 3.5e9
    """Of the unreacted charge."""
    shear_strength: Annotated[Pressure, Bounds(0.0, 1e11, "strengths of solids", usual=(0.0, 1e9))] = 5.0e7
    """Of the unreacted charge."""
    jwl: JonesWilkinsLee | None = None
    """Constants for products = "jwl"."""
    source: str = ""
    """Where the constants come from."""
    critical_energy: EnergyRange | None = None
    """Smallest and largest published energy per area of a plane shock that initiates it."""
    critical_energy_source: str = ""
    """Where they come from."""

    @property
    def hugoniot_limit(self) -> float:
        """Largest rho/rho0 - 1 up to which the unreacted charge follows its Hugoniot: 0.6 of 1/s in 1 - rho0/rho.

        There it is at about twice rho0 c0^2, above the detonation's pressure; the pole at 1/s is never met.
        """
        return 0.6 / (self.hugoniot_slope - 0.6)

    @property
    def models(self) -> tuple[ProductModel, ...]:
        """Models of the products for which it has the constants."""
        return tuple(model for model in get_args(ProductModel) if not self.lacks(model))

    def lacks(self, products: ProductModel) -> tuple[str, ...]:
        """Constants that the burst needs with these products and that it has not."""
        needed = ("jwl" if products == "jwl" else "heat_of_detonation", "sound_speed")
        return tuple(key for key in needed if getattr(self, key) is None)

    def known(self, key: Literal["heat_of_detonation", "sound_speed"]) -> float:
        """A constant that may be left out, where it is needed; raises InputError where it is left out."""
        value = getattr(self, key)
        if value is None:
            raise InputError(f"explosive '{self.name}': {key} is missing; the burst needs it")
        return float(value)

    def shock_speed(self, pressure: float) -> float:
        """Speed U (m/s) of a plane shock of that pressure (Pa) in the unreacted charge: P = rho0 U u, U = c0 + s u."""
        sound = self.known("sound_speed")
        return 0.5 * (sound + (sound**2 + 4.0 * self.hugoniot_slope * pressure / self.density) ** 0.5)


@dataclass(frozen=True, kw_only=True)
class CasingMaterial:
    """A casing material: Tresca with linear softening and tension cut-off (Eqs. 8-11)."""

    name: str
    """What outputs call it."""
    density: Annotated[Density, Bounds(100.0, 2.5e4, "densities of metals", usual=(1500.0, 2e4))]
    """Density."""
    elastic_modulus: Annotated[PositivePressure, Bounds(1e6, 5e12, "moduli of solids", usual=(1e9, 6e11))]
    """Young's modulus."""
    poisson_ratio: Annotated[float, Bounds(-0.99, 0.499, "cells lock at 0.5", usual=(0.0, 0.45))]
    """Poisson's ratio."""
    shear_strength: Annotated[PositivePressure, Bounds(1e4, 1e11, "strengths of solids", usual=(1e7, 3e9))]
    """Half the yield stress of a tensile test (tau_c)."""
    tensile_strength: Annotated[PositivePressure, Bounds(1e4, 1e11, "strengths of solids", usual=(1e7, 1e10))]
    """Tension cut-off (sigma_t)."""
    shear_softening_strain: float | None = 0.5
    """Equivalent plastic shear strain at which tau_c is zero; None: no softening."""
    tensile_softening_strain: float | None = 0.5
    """Plastic volumetric strain at which sigma_t is zero; None: no softening."""
    softening_length: float | None = None
    """Scales the softening strains by this length (m) over the cell's; None: not scaled."""
    source: str = ""
    """Where the constants come from."""
