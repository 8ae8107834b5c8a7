"""What the burst stage is asked to compute: plain data in SI units, without defaults that hide a choice.

`fragfield` fills these from a case file, whose tables are made from them; a user of the package may fill them by hand.
What stands at a field is its entry in the case reference: unit, bounds with their reason, meaning.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, get_args

from burst_fenicsx.errors import InputError
from fragfield_base.inputs import (
    Bounds,
    Density,
    EnergyRange,
    OnlyWith,
    PositiveLength,
    PositivePressure,
    Pressure,
    Quantity,
    Speed,
    Time,
)

if TYPE_CHECKING:
    from pathlib import Path

    from burst_fenicsx.geometry import Profile

__all__ = [
    "BurstSettings",
    "CasingMaterial",
    "ContactSettings",
    "Explosive",
    "Geometry",
    "Hourglass",
    "IgnitionPoint",
    "JonesWilkinsLee",
    "Leakage",
    "Mirror",
    "OutputInterval",
    "Part",
    "ProductModel",
    "RigidPlane",
    "Round",
    "ShockInitiation",
    "TimeStep",
    "Viscosity",
]

ProductModel = Literal["landau", "landau_cj", "jwl"]
BurnModel = Literal["time", "time_or_compression"]
Quadrature = Literal["one_point", "full"]
Interface = Literal["sliding", "shared"]
Geometry = Literal["3d", "axisymmetric"]
Symmetry = Literal["auto", "off"]
OutputInterval = Annotated[Time, Bounds(1e-9, 0.1, "shorter than a step, or longer than any burst", usual=(1e-7, 1e-3))]

_BondStrength = Annotated[
    Pressure, Bounds(0.0, 1e12, "stronger than any solid", usual=(0.0, 1e9)), OnlyWith("charge_casing", ("sliding",))
]
_NO_END = OnlyWith("end_time", (None,))


class Part(IntEnum):
    """What a cell is made of."""

    CASING = 0
    CHARGE = 1
    FUZE = 2


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


@dataclass(frozen=True)
class IgnitionPoint:
    """A point that initiates the charge.

    `station` is measured along the axis from the nose end of the round (m), `offset` is the place
    across the axis (m); `delay` is the time at which the point fires (s).
    """

    station: float
    offset: tuple[float, float] = (0.0, 0.0)
    delay: float = 0.0


@dataclass(frozen=True)
class ShockInitiation:
    """Initiation of a charge by a neighbour's shock: a cell ignites once its pressure has been held.

    `pressure` (Pa) is the threshold, `duration` (s) how long a cell must stay above it without a break; with an
    infinite pressure nothing ignites, and what the shock does to the charge is reported (`exposure`). Pulses below
    `floor` (Pa) do not count there.
    """

    pressure: float
    duration: float = 0.0
    floor: float = 1e9


@dataclass(frozen=True)
class Round:
    """One cased charge in space.

    `position` is the centre of the base plane; `axis` points from the base to the nose.
    Either `profile` or `mesh_file` is given. A round without ignition points needs `initiation`.
    """

    name: str
    explosive: Explosive
    casing: CasingMaterial
    profile: Profile | None = None
    mesh_file: Path | None = None
    position: tuple[float, float, float] = (0.0, 0.0, 0.0)
    axis: tuple[float, float, float] = (0.0, 0.0, 1.0)
    ignition: tuple[IgnitionPoint, ...] = ()
    initiation: ShockInitiation | None = None  # initiated by shock as well as by its points
    mesh_unit: str = "m"  # of the mesh file's numbers


@dataclass(frozen=True)
class Leakage:
    """Venting of the products through the opened casing (Eqs. 6-7)."""

    enabled: bool = True
    """Whether the products vent."""
    radius_ratio: Annotated[
        float,
        Bounds(
            1.0, 20.0,
            "published radii of venting are 1.59, 1.73 and about 2.0; the final speed depends on it most",
            usual=(1.59, 2.1),
        ),
        OnlyWith("enabled", (True,)),
    ] = 1.75  # fmt: skip
    """Mean radius of the charge at which venting starts, over the initial one (published: 1.59 to about 2.0)."""
    alpha: Annotated[
        float, Bounds(0.0, 1.0, "a share of the free venting", above=True), OnlyWith("enabled", (True,))
    ] = 1.0
    """Factor of Eq. 7."""
    beta: Annotated[float, Bounds(0.0, 100.0, "above, the products are gone at once"), OnlyWith("enabled", (True,))] = (
        1.0
    )
    """Exponent of Eq. 7."""
    parts: Annotated[
        int,
        Bounds(1, 10000, "more parts than a charge has cells along its axis", usual=(1, 500)),
        OnlyWith("enabled", (True,)),
    ] = 20
    """Axial parts of each charge, each with a radius of its own."""


@dataclass(frozen=True)
class Viscosity:
    """Artificial viscosity, in compression only: q = rho L |D| (linear c + quadratic L |D|)."""

    linear: Annotated[float, Bounds(0.0, 10.0, "more damping than a shock has steepness", usual=(0.0, 1.0))] = 0.06
    """Factor of the linear term."""
    quadratic: Annotated[float, Bounds(0.0, 20.0, "more damping than a shock has steepness", usual=(0.0, 4.0))] = 1.5
    """Factor of the quadratic term."""


@dataclass(frozen=True)
class Hourglass:
    """Hourglass control of the one-point quadrature (Flanagan and Belytschko)."""

    charge_viscous: Annotated[float, Bounds(0.0, 1.0, "above 1 the control is unstable", usual=(0.0, 0.3))] = 0.10
    """Viscous factor in charge and products."""
    casing_viscous: Annotated[float, Bounds(0.0, 1.0, "above 1 the control is unstable", usual=(0.0, 0.3))] = 0.03
    """Viscous factor in the casing."""
    casing_stiffness: Annotated[
        float, Bounds(0.0, 1.0, "above 1 the control is stiffer than the metal", usual=(0.0, 0.3))
    ] = 0.03
    """Stiffness factor in the casing."""


@dataclass(frozen=True)
class ContactSettings:
    """Contact of charge and casing (face-face, Eqs. 12-15) and of surfaces that meet (point-face, Eqs. 16-18)."""

    charge_casing: Interface = "sliding"
    """Charge bonded to the casing until it has reacted, then sliding; or shared nodes, which never slip."""
    cohesion: _BondStrength = 5e6
    """Shear stress at which the bond of the unreacted charge breaks without pressure on it."""
    tensile_strength: _BondStrength = 5e6
    """Tension at which the bond of the unreacted charge breaks."""
    friction_angle: float = 20.0
    """Of the unreacted charge on the casing, where their bond is broken; products have no friction (degrees)."""
    surfaces: bool = True
    """Whether surfaces that meet push each other; without it rounds pass through each other."""
    surface_friction_angle: float = 20.0
    """Of surfaces that meet (degrees)."""


@dataclass(frozen=True)
class RigidPlane:
    """A plane that no casing passes: ground, deck, barricade.

    `point` (m) lies on it; `normal` points to the side on which the rounds stand.
    """

    name: str
    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    friction_angle: float = 20.0  # degrees


@dataclass(frozen=True)
class Mirror:
    """A plane of symmetry: it stands for the images behind it and holds metal before it, without friction.

    `point` (m) lies on it; `normal` points to the computed side; `bit` is its number among the planes found by
    `symmetry`. Images behind a plane that the user gives are added by the break-up, with seeds of their own.
    """

    name: str
    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    bit: int = 0
    friction_angle: ClassVar[float] = 0.0


@dataclass(frozen=True)
class TimeStep:
    """The size of a step.

    With `subcycling` time stepping is local, with steps powers of two apart (see `burst_fenicsx.mechanics.subcycling`).
    """

    cfl: Annotated[
        float,
        Bounds(0.0, 1.0, "a fraction of the stable step", above=True, below=True),
        OnlyWith("fixed", (None,)),
    ] = 0.8
    """Fraction of the stable step."""
    fixed: Annotated[
        float | None,
        Quantity("s", "10 ns", above=0.0),
        Bounds(1e-12, 1e-5, "no cell is stable with steps above 10 us", usual=(1e-10, 1e-7)),
    ] = None
    """A fixed step instead of the stable one (the paper: 10 ns)."""
    subcycling: bool = True
    """Whether cells take steps of their own, most of them long ones; not with a fixed step or with damping."""


@dataclass(frozen=True)
class BurstSettings:
    """How the burst is computed."""

    cell_size: Annotated[
        PositiveLength,
        Bounds(1e-4, 0.5, "cells below 0.1 mm need years, above 0.5 m no casing has one", usual=(5e-4, 0.02)),
    ]
    """Target edge length of the cells; the only mesh parameter."""
    geometry: Geometry = "3d"
    """Hexahedra, or rings of a round's meridian."""
    symmetry: Symmetry = "auto"
    """Compute the smallest part of the arrangement that planes of symmetry bound, or every round in full."""
    quadrature: Quadrature = "one_point"
    """One point with hourglass control, or 2 x 2 x 2 points with mean dilatation."""
    products: ProductModel = "landau_cj"
    """Law of the detonation products."""
    burn: BurnModel = "time_or_compression"
    """Burn fraction by time (Eq. 5, the paper's) or by the larger of that and the compression."""
    end_time: Annotated[
        float | None,
        Quantity("s", "120 us", above=0.0),
        Bounds(1e-9, 1e-2, "a burst is over within milliseconds", usual=(1e-5, 1e-3)),
    ] = None
    """End of the burst, for stop = "time"; left out: when the acceleration is complete."""
    acceleration_tolerance: Annotated[
        float, Bounds(0.0, 1.0, "a fraction of the energy", above=True, below=True), _NO_END
    ] = 1e-2
    """Acceleration is complete when the casing's kinetic energy grows by less than this fraction ..."""
    acceleration_window: Annotated[Time, Bounds(1e-9, 1e-2, "a burst is over within milliseconds"), _NO_END] = 10e-6
    """... over this time."""
    time_limit: Annotated[Time, Bounds(1e-9, 0.1, "a burst is over within milliseconds"), _NO_END] = 1e-3
    """Never longer than this."""
    energy_tolerance: Annotated[float, Bounds(0.0, 1.0, "a fraction of the work", above=True)] = 0.05
    """The burst stops when its energies miss the work of the products by more than this fraction."""
    damping: Annotated[
        float,
        Quantity("1/s", "100 / s", minimum=0.0),
        Bounds(0.0, 1e7, "nothing would move", usual=(0.0, 1e5)),
    ] = 0.0
    """Resistance of the nodes in proportion to mass and velocity."""
    time_step: TimeStep = field(default_factory=TimeStep)
    leakage: Leakage = field(default_factory=Leakage)
    viscosity: Viscosity = field(default_factory=Viscosity)
    hourglass: Hourglass = field(default_factory=Hourglass)
    contact: ContactSettings = field(default_factory=ContactSettings)
    output_interval: OutputInterval = 10e-6
    """Simulated time between two states of burst.xdmf."""
    nodal_stress: bool = False
    """Whether burst.xdmf has the stress projected to the nodes as well, for smooth contours."""
    planes: tuple[RigidPlane | Mirror, ...] = ()
    """What no casing passes."""
