"""The table [burst]: how the detonation is computed; defaults, units and bounds are those of the burst stage."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from burst_fenicsx.problem import (
    BurstSettings,
    ContactSettings,
    Hourglass,
    Leakage,
    OutputInterval,
    TimeStep,
    Viscosity,
)
from fragfield.case.tables.base import Table
from fragfield_base.inputs import FrictionAngle, OnlyWith
from fragfield_base.units import degrees

__all__ = [
    "BurstTable",
    "ContactTable",
    "HourglassTable",
    "LeakageTable",
    "OutputTable",
    "TimeStepTable",
    "ViscosityTable",
]


class TimeStepTable(Table, TimeStep):
    """The size of a step."""


class LeakageTable(Table, Leakage):
    """Venting of the products through the opened casing (Eqs. 6-7)."""


class ViscosityTable(Table, Viscosity):
    """Artificial viscosity, in compression only."""


class HourglassTable(Table, Hourglass):
    """Hourglass control of the one-point quadrature."""


class ContactTable(Table, ContactSettings):
    """Contact of charge and casing (face-face, Eqs. 12-15) and of surfaces that meet (point-face, Eqs. 16-18)."""

    friction_angle: Annotated[FrictionAngle, OnlyWith("charge_casing", ("sliding",))] = degrees(
        ContactSettings.friction_angle
    )
    """Of the unreacted charge on the casing, where their bond is broken; products have no friction."""
    surface_friction_angle: Annotated[FrictionAngle, OnlyWith("surfaces", (True,))] = degrees(
        ContactSettings.surface_friction_angle
    )
    """Of surfaces that meet."""


class OutputTable(Table):
    """What is written while the burst runs."""

    interval: OutputInterval = BurstSettings.output_interval
    """Simulated time between two states of burst.xdmf."""
    nodal_stress: bool = BurstSettings.nodal_stress
    """Whether burst.xdmf has the stress projected to the nodes as well, for smooth contours."""


class BurstTable(Table, BurstSettings):
    """How the burst is computed."""

    NO_KEYS: ClassVar = ("output_interval", "nodal_stress", "planes")
    ORDER: ClassVar = ("cell_size", "geometry", "convergence", "symmetry", "quadrature", "products", "burn", "stop")
    geometry: Literal["auto", "axisymmetric", "3d"] = "auto"  # type: ignore[assignment]
    """Rings of a round's meridian, or hexahedra; auto: rings where one round, initiated on its axis, allows it."""
    convergence: Literal["off", "quick", "standard", "final"] = "standard"
    """Cell sizes for the grid convergence, besides h = `cell_size`: quick 2 h; standard sqrt(2) h and 2 h; final
    h / sqrt(2) as well. In three dimensions final alone, sqrt(2) h and 2 h."""
    stop: Literal["acceleration", "time"] | None = None
    """Stop when the casing no longer accelerates, or at `end_time`; left out: by time if `end_time` is given."""
    time_step: TimeStepTable = TimeStepTable()
    leakage: LeakageTable = LeakageTable()
    viscosity: ViscosityTable = ViscosityTable()
    hourglass: Annotated[HourglassTable, OnlyWith("quadrature", ("one_point",))] = HourglassTable()
    contact: ContactTable = ContactTable()
    output: OutputTable = OutputTable()
