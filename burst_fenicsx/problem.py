"""What the burst stage is asked to compute: plain data in SI units, without defaults that hide a choice.

`fragfield` fills these from a case file; a user of the package may fill them by hand.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, ClassVar, Literal

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


class Part(IntEnum):
    """What a cell is made of."""

    CASING = 0
    CHARGE = 1
    FUZE = 2


@dataclass(frozen=True)
class JonesWilkinsLee:
    """Constants of P = A (1 - omega/(R1 V)) exp(-R1 V) + B (1 - omega/(R2 V)) exp(-R2 V) + omega E/V."""

    A: float  # Pa
    B: float  # Pa
    R1: float
    R2: float
    omega: float
    E0: float  # energy per initial volume (J/m3)


@dataclass(frozen=True)
class Explosive:
    """A high explosive. Units: kg/m3, m/s, J/kg, m/s.

    Shocks in the unreacted charge run at U = c0 + s u behind which matter moves at u: c0 is `sound_speed`, s
    `hugoniot_slope`.
    """

    name: str
    density: float
    detonation_velocity: float
    heat_of_detonation: float
    sound_speed: float  # bulk, of the unreacted charge
    jwl: JonesWilkinsLee | None = None
    shear_modulus: float = 3.5e9  # of the unreacted charge (Pa)
    shear_strength: float = 5.0e7  # of the unreacted charge (Pa)
    source: str = ""
    critical_energy: tuple[float, float] | None = None  # of initiation by shock: published range (J/m2)
    critical_energy_source: str = ""
    hugoniot_slope: float = 1.9  # s, of published fits 1.4 to 2.2 (1 or more)

    @property
    def hugoniot_limit(self) -> float:
        """Largest rho/rho0 - 1 up to which the unreacted charge follows its Hugoniot: 0.6 of 1/s in 1 - rho0/rho.

        There it is at about twice rho0 c0^2, above the detonation's pressure; the pole at 1/s is never met.
        """
        return 0.6 / (self.hugoniot_slope - 0.6)

    def shock_speed(self, pressure: float) -> float:
        """Speed U (m/s) of a plane shock of that pressure (Pa) in the unreacted charge: P = rho0 U u, U = c0 + s u."""
        steep = 4.0 * self.hugoniot_slope * pressure / self.density
        return 0.5 * (self.sound_speed + (self.sound_speed**2 + steep) ** 0.5)


@dataclass(frozen=True)
class CasingMaterial:
    """Tresca with linear softening and tension cut-off (Eqs. 8-11). Units: kg/m3, Pa."""

    name: str
    density: float
    elastic_modulus: float
    poisson_ratio: float
    shear_strength: float  # tau_c, half the uniaxial yield stress
    tensile_strength: float  # sigma_t
    shear_softening_strain: float | None = 0.5  # gamma_lim; None: no softening
    tensile_softening_strain: float | None = 0.5  # eps_lim; None: no softening
    softening_length: float | None = None  # limits are scaled by this over the cell's length (m); None: not scaled
    source: str = ""


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


@dataclass(frozen=True)
class Leakage:
    """Venting of the products through the opened casing (Eqs. 6-7)."""

    enabled: bool = True
    radius_ratio: float = 1.75  # r_cr / r0
    alpha: float = 1.0
    beta: float = 1.0
    parts: int = 20  # axial parts of each charge


@dataclass(frozen=True)
class Viscosity:
    """Artificial viscosity in compression: q = rho L |D| (linear c + quadratic L |D|)."""

    linear: float = 0.06
    quadratic: float = 1.5


@dataclass(frozen=True)
class Hourglass:
    """Flanagan-Belytschko coefficients of the one-point quadrature."""

    charge_viscous: float = 0.10
    casing_viscous: float = 0.03
    casing_stiffness: float = 0.03


@dataclass(frozen=True)
class ContactSettings:
    """Contact of charge and casing (face-face, Eqs. 12-15) and of any surfaces that meet (point-face, Eqs. 16-18)."""

    charge_casing: Interface = (
        "sliding"  # bonded until reacted, then the products slide; "shared": common nodes, no slip
    )
    cohesion: float = 5e6  # c of the unreacted charge's bond (Pa)
    tensile_strength: float = 5e6  # T of the unreacted charge's bond (Pa)
    friction_angle: float = 20.0  # of the unreacted charge on the casing (degrees); products have none
    surfaces: bool = True  # whether surfaces that meet push each other
    surface_friction_angle: float = 20.0  # of colliding surfaces (degrees)


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
    """`fixed` (s) overrides the CFL step, which is `cfl` times the stable limit.

    With `subcycling` time stepping is local, with steps powers of two apart (see `burst_fenicsx.mechanics.subcycling`).
    """

    cfl: float = 0.8
    fixed: float | None = None
    subcycling: bool = True


@dataclass(frozen=True)
class BurstSettings:
    """How the burst is computed. SI units."""

    cell_size: float
    geometry: Geometry = "3d"  # "axisymmetric": one round in its meridian
    quadrature: Quadrature = "one_point"
    products: ProductModel = "landau_cj"
    burn: BurnModel = "time_or_compression"
    end_time: float | None = None  # None: stop when the acceleration is complete
    acceleration_tolerance: float = 1e-2  # growth of the casing's kinetic energy ...
    acceleration_window: float = 10e-6  # ... over this time (s)
    time_limit: float = 1e-3  # never longer than this (s)
    output_interval: float = 10e-6
    nodal_stress: bool = False  # whether outputs have the stress projected to the nodes
    energy_tolerance: float = 0.05  # a ledger further open than this stops the run
    damping: float = 0.0  # resistance of the nodes in proportion to mass and velocity (1/s), F^d of Eq. 2
    time_step: TimeStep = field(default_factory=TimeStep)
    leakage: Leakage = field(default_factory=Leakage)
    viscosity: Viscosity = field(default_factory=Viscosity)
    hourglass: Hourglass = field(default_factory=Hourglass)
    contact: ContactSettings = field(default_factory=ContactSettings)
    planes: tuple[RigidPlane | Mirror, ...] = ()
    symmetry: Symmetry = "auto"  # compute the smallest symmetric part of the arrangement, see `symmetry`; "off": all
