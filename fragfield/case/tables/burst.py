"""The table [burst]: how the detonation is computed."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fragfield.case.tables.base import Table
from fragfield.case.units.kinds import FrictionAngle, PositiveLength, Pressure, Time
from fragfield.case.units.quantities import Quantity, degrees

__all__ = [
    "BurstTable",
    "ContactTable",
    "HourglassTable",
    "LeakageTable",
    "OutputTable",
    "TimeStepTable",
    "ViscosityTable",
]


class TimeStepTable(Table):
    """The size of a step."""

    cfl: float = Field(default=0.8, gt=0.0, lt=1.0)
    """Fraction of the stable step."""
    fixed: Annotated[float | None, Quantity("s", "10 ns", above=0.0)] = None
    """A fixed step instead of the stable one (the paper: 10 ns)."""
    subcycling: bool = True
    """Whether cells take steps of their own, most of them long ones; not with a fixed step or with damping."""


class LeakageTable(Table):
    """Venting of the products through the opened casing (Eqs. 6-7)."""

    enabled: bool = True
    """Whether the products vent."""
    radius_ratio: float = Field(default=1.75, ge=1.0)
    """Mean radius of the charge at which venting starts, over the initial one (published: 1.59 to about 2.0)."""
    alpha: float = Field(default=1.0, gt=0.0, le=1.0)
    """Factor of Eq. 7."""
    beta: float = Field(default=1.0, ge=0.0)
    """Exponent of Eq. 7."""
    parts: int = Field(default=20, ge=1)
    """Axial parts of each charge, each with a radius of its own."""


class ViscosityTable(Table):
    """Artificial viscosity, in compression only."""

    linear: float = Field(default=0.06, ge=0.0)
    """Factor of the linear term."""
    quadratic: float = Field(default=1.5, ge=0.0)
    """Factor of the quadratic term."""


class HourglassTable(Table):
    """Hourglass control of the one-point quadrature."""

    charge_viscous: float = Field(default=0.10, ge=0.0)
    """Viscous factor in charge and products."""
    casing_viscous: float = Field(default=0.03, ge=0.0)
    """Viscous factor in the casing."""
    casing_stiffness: float = Field(default=0.03, ge=0.0)
    """Stiffness factor in the casing."""


class ContactTable(Table):
    """Contact of charge and casing (face-face, Eqs. 12-15) and of surfaces that meet (point-face, Eqs. 16-18)."""

    charge_casing: Literal["sliding", "shared"] = "sliding"
    """Charge bonded to the casing until it has reacted, then sliding; or shared nodes, which never slip."""
    cohesion: Pressure = 5e6
    """Shear stress at which the bond of the unreacted charge breaks without pressure on it."""
    tensile_strength: Pressure = 5e6
    """Tension at which the bond of the unreacted charge breaks."""
    friction_angle: FrictionAngle = degrees(20.0)
    """Of the unreacted charge on the casing, where their bond is broken; products have no friction."""
    surfaces: bool = True
    """Whether surfaces that meet push each other; without it rounds pass through each other."""
    surface_friction_angle: FrictionAngle = degrees(20.0)
    """Of surfaces that meet."""


class OutputTable(Table):
    """What is written while the burst runs."""

    interval: Time = 10e-6
    """Simulated time between two states of burst.xdmf."""
    nodal_stress: bool = False
    """Whether burst.xdmf has the stress projected to the nodes as well, for smooth contours."""


class BurstTable(Table):
    """How the burst is computed."""

    cell_size: PositiveLength
    """Target edge length of the cells; the only mesh parameter."""
    geometry: Literal["auto", "axisymmetric", "3d"] = "auto"
    """Rings of a round's meridian, or hexahedra; auto: rings where one round, initiated on its axis, allows it."""
    convergence: Literal["off", "quick", "standard", "final"] = "standard"
    """Cell sizes for the grid convergence, besides h = `cell_size`: quick 2 h; standard sqrt(2) h and 2 h; final
    h / sqrt(2) as well. In three dimensions final alone, sqrt(2) h and 2 h."""
    symmetry: Literal["auto", "off"] = "auto"
    """Compute the smallest part of the arrangement that planes of symmetry bound, or every round in full."""
    quadrature: Literal["one_point", "full"] = "one_point"
    """One point with hourglass control, or 2 x 2 x 2 points with mean dilatation."""
    products: Literal["landau", "landau_cj", "jwl"] = "landau_cj"
    """Law of the detonation products."""
    burn: Literal["time", "time_or_compression"] = "time_or_compression"
    """Burn fraction by time (Eq. 5, the paper's) or by the larger of that and the compression."""
    stop: Literal["acceleration", "time"] | None = None
    """Stop when the casing no longer accelerates, or at `end_time`; left out: by time if `end_time` is given."""
    end_time: Annotated[float | None, Quantity("s", "120 us", above=0.0)] = None
    """End of the burst for stop = "time"."""
    acceleration_tolerance: float = Field(default=1e-2, gt=0.0, lt=1.0)
    """Acceleration is complete when the casing's kinetic energy grows by less than this fraction ..."""
    acceleration_window: Time = 10e-6
    """... over this time."""
    time_limit: Time = 1e-3
    """Never longer than this."""
    energy_tolerance: float = Field(default=0.05, gt=0.0, le=1.0)
    """The burst stops when its energies miss the work of the products by more than this fraction."""
    damping: Annotated[float, Quantity("1/s", "100 / s", minimum=0.0)] = 0.0
    """Resistance of the nodes in proportion to mass and velocity."""
    time_step: TimeStepTable = TimeStepTable()
    leakage: LeakageTable = LeakageTable()
    viscosity: ViscosityTable = ViscosityTable()
    hourglass: HourglassTable = HourglassTable()
    contact: ContactTable = ContactTable()
    output: OutputTable = OutputTable()
