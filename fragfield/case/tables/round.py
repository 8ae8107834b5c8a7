"""The tables [[round]]: cased charges, their materials and their ignition points."""

from __future__ import annotations

import math
from typing import Annotated, Any

from pydantic import Discriminator, Field, Tag

from fragfield.case.tables.base import Table, name_or_table
from fragfield.case.units.compound import NumberOrWord
from fragfield.case.units.kinds import (
    Angle,
    Density,
    Direction,
    EnergyPerMass,
    EnergyRange,
    Offset,
    Position,
    Pressure,
    Speed,
)
from fragfield.case.units.quantities import Quantity

__all__ = [
    "CasingTable",
    "ExpectedTable",
    "ExplosiveTable",
    "IgnitionTable",
    "InitiationTable",
    "JwlTable",
    "RoundTable",
    "StandsOn",
]

PositivePressure = Annotated[float, Quantity("Pa", "3.5 GPa", above=0.0)]
Attitude = Annotated[
    float | str | None, Quantity("rad", "30 deg", minimum=0.0, maximum=math.pi, words=("upright", "lying", "any"))
]
StandsOn = Annotated[float | str | None, Quantity("m", "0 m", words=("ground",))]
SofteningStrain = Annotated[float | str, NumberOrWord(("none",), 0.5)]


ProfileValue = Annotated[
    Annotated[str, Tag("<name>")] | Annotated[dict[str, Any], Tag("<table>")], Discriminator(name_or_table)
]


class JwlTable(Table):
    """Constants of the law of Jones, Wilkins and Lee: P over the relative volume V, with its own energy E."""

    A: PositivePressure
    """Pressure of the first exponential."""
    B: Annotated[float, Quantity("Pa", "3.231 GPa")]
    """Pressure of the second exponential."""
    R1: float = Field(gt=0.0)
    """Rate of the first exponential."""
    R2: float = Field(gt=0.0)
    """Rate of the second exponential."""
    omega: float = Field(gt=0.0)
    """Gruneisen coefficient."""
    E0: Annotated[float, Quantity("J/m^3", "7 GJ/m^3", above=0.0)]
    """Energy per initial volume."""


class ExplosiveTable(Table):
    """An explosive with its constants."""

    name: str
    """What outputs call it."""
    density: Density
    """Density of the charge."""
    detonation_velocity: Speed
    """Speed D of the steady detonation front."""
    heat_of_detonation: EnergyPerMass
    """Heat Q of detonation; the Landau models need more than D^2 / 16."""
    sound_speed: Speed
    """Bulk sound speed of the unreacted charge: c0 of its shocks, U = c0 + s u."""
    hugoniot_slope: float = 1.9
    """s of the same; published fits have 1.4 to 2.2."""
    shear_modulus: PositivePressure = 3.5e9
    """Of the unreacted charge."""
    shear_strength: Pressure = 5.0e7
    """Of the unreacted charge."""
    jwl: JwlTable | None = None
    """Constants for products = "jwl"."""
    source: str = ""
    """Where the constants come from."""
    critical_energy: EnergyRange | None = None
    """Smallest and largest published energy per area of a plane shock that initiates it."""
    critical_energy_source: str = ""
    """Where they come from."""


class CasingTable(Table):
    """A casing material: Tresca with linear softening and tension cut-off (Eqs. 8-11)."""

    name: str
    """What outputs call it."""
    density: Density
    """Density."""
    elastic_modulus: PositivePressure
    """Young's modulus."""
    poisson_ratio: float = Field(gt=-1.0, lt=0.5)
    """Poisson's ratio."""
    shear_strength: PositivePressure
    """Half the yield stress of a tensile test (tau_c)."""
    tensile_strength: PositivePressure
    """Tension cut-off (sigma_t)."""
    shear_softening_strain: SofteningStrain = 0.5
    """Equivalent plastic shear strain at which tau_c is zero, or "none"."""
    tensile_softening_strain: SofteningStrain = 0.5
    """Plastic volumetric strain at which sigma_t is zero, or "none"."""
    softening_length: Annotated[float | str, Quantity("m", "3 mm", above=0.0, words=("none",))] = "none"
    """Scales the softening strains by this length over the cell's, for the energy of a tear one cell wide; "none": not
    scaled, as suits a casing that stretches evenly."""
    source: str = ""
    """Where the constants come from."""


class IgnitionTable(Table):
    """A point that initiates the charge."""

    station: Annotated[float | str, Quantity("m", "30 mm", words=("nose", "middle", "base"))] = "nose"
    """Position along the axis from the round's nose end; or the nose end, the middle or the base end of the charge."""
    offset: Offset = (0.0, 0.0)
    """Position across the axis."""
    delay: Annotated[float, Quantity("s", "0 us", minimum=0.0)] = 0.0
    """Time at which the point fires."""


class InitiationTable(Table):
    """Initiation of the charge by the shock of a neighbour: every cell pressed hard and long enough ignites."""

    pressure: Annotated[float | None, Quantity("Pa", "5 GPa", above=0.0)] = None
    """Pressure that a cell must hold; left out: no pressure initiates it, and only what the shock does is reported."""
    duration: Annotated[float, Quantity("s", "0.2 us", minimum=0.0)] = 0.0
    """Time for which it must hold it without a break."""
    floor: PositivePressure = 1e9
    """Pressure below which a pulse does not count for the energy that is reported against the critical one."""


class ExpectedTable(Table):
    """Masses that the drawing gives: those of the contours and materials must be within 1 % of them."""

    casing: Annotated[float | None, Quantity("kg", "34.5 kg", above=0.0)] = None
    """Mass of the casing."""
    charge: Annotated[float | None, Quantity("kg", "6.86 kg", above=0.0)] = None
    """Mass of the charge."""


class RoundTable(Table):
    """One cased charge in space."""

    name: str = Field(min_length=1)
    """A name of its own."""
    profile: ProfileValue | None = None
    """Contours: a built-in name, a profile file, or the profile's tables themselves."""
    mesh: str | None = None
    """A gmsh file of hexahedra with the physical groups "charge" and "casing", instead of a profile."""
    explosive: Annotated[
        Annotated[str, Tag("<name>")] | Annotated[ExplosiveTable, Tag("<table>")], Discriminator(name_or_table)
    ]
    """A built-in name, a file, or a table."""
    casing: Annotated[
        Annotated[str, Tag("<name>")] | Annotated[CasingTable, Tag("<table>")], Discriminator(name_or_table)
    ]
    """A built-in name, a file, or a table."""
    expected: ExpectedTable | None = Field(
        default=None, json_schema_extra={"inline": '{ casing = "34.5 kg", charge = "6.86 kg" }'}
    )
    """Masses from the drawing of the round, against which contours and materials are checked (1 %): this finds
    diameters given for radii, and wrong units. Give them wherever the drawing has them."""
    position: Position = (0.0, 0.0, 0.0)
    """Centre of the base plane."""
    base: StandsOn = None
    """"ground": the round stands or lies on the ground at its x and y, flat or of a map of heights; or z of its lowest
    point. It sets the z of `position`, which is left at 0 m; left out: by `position`."""
    attitude: Attitude = None
    """How the round stands: "upright" (axis and nose up), "lying", the inclination of its axis from upright (180 deg:
    nose down), or "any": the worst of all attitudes. Left out: by `axis`."""
    azimuth: Angle | None = None
    """Direction in plan to which the nose of a lying or inclined round points, from +x counter-clockwise; left out:
    0 deg."""
    axis: Direction = Field(default=(0.0, 0.0, 1.0), json_schema_extra={"instead_of": "attitude"})
    """Direction from the base to the nose, z up, instead of `attitude`."""
    ignition: list[IgnitionTable] | None = None
    """Ignition points; left out: one at the nose end of the charge, on the axis. Empty: by `initiation` alone."""
    initiation: InitiationTable | None = None
    """Initiation by a neighbour's shock, besides the ignition points; left out: by them alone."""
