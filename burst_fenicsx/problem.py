"""What the burst stage is asked to compute: plain data in SI units, without defaults that hide a choice.

`fragfield` fills these from a case file, whose tables are made from them; a user of the package may fill them by hand.
What stands at a field is its entry in the case reference: unit, bounds with their reason, meaning.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from enum import IntEnum
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from burst_fenicsx.substances import CasingMaterial, Explosive, JonesWilkinsLee, ProductModel
from fragfield_base.bounds import Bounds, OnlyWith
from fragfield_base.inputs import Offset, PositiveLength, PositivePressure, Pressure, Quantity, Time

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
class IgnitionPoint:
    """A point that initiates the charge."""

    station: float
    """Position along the axis from the nose end of the round (m)."""
    offset: Annotated[Offset, Bounds(-100.0, 100.0, "no round is 100 m wide")] = (0.0, 0.0)
    """Position across the axis."""
    delay: Annotated[
        float, Quantity("s", "0 us", minimum=0.0), Bounds(0.0, 0.1, "a burst is over within milliseconds")
    ] = 0.0
    """Time at which the point fires."""


@dataclass(frozen=True)
class ShockInitiation:
    """Initiation of the charge by the shock of a neighbour: every cell pressed hard and long enough ignites."""

    pressure: float = math.inf
    """Pressure that a cell must hold (Pa); infinite: nothing ignites, and what the shock does is reported."""
    duration: Annotated[
        float, Quantity("s", "0.2 us", minimum=0.0), Bounds(0.0, 1e-3, "shocks last microseconds", usual=(0.0, 2e-5))
    ] = 0.0
    """Time for which it must hold it without a break."""
    floor: PositivePressure = 1e9
    """Pressure below which a pulse does not count for the energy that is reported against the critical one."""


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
    """End of the burst, complete or not: speeds are those at that time; left out: by `acceleration_left`."""
    acceleration_left: Annotated[
        float, Bounds(0.0, 1.0, "a fraction of the energy", above=True, below=True, usual=(0.02, 0.2)), _NO_END
    ] = 0.1
    """The burst ends where every casing's kinetic energy, or that of all rounds that have touched, has at most this
    fraction to gain by its asymptote, which the fragments' speeds are taken to."""
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
