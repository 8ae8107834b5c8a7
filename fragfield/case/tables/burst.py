"""The tables [burst] and [break_up]; defaults, units and bounds are those of the stages."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal, get_args

from pydantic import Field

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
from fragfield_base.bounds import Bounds, Entries, OnlyWith
from fragfield_base.inputs import FrictionAngle, Length, Quantity, QuantityOrFile
from fragfield_base.units import degrees
from transition.law.fragment_counts import FragmentCounts
from transition.settings import MEAN_MASS, BreakUpSettings, MeanMassLaw


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


_MEAN_MASS = QuantityOrFile("kg", "14.9 g", above=0.0, words=get_args(MeanMassLaw), holds="counted fragments")
_GROUPS = Entries(10000, "groups of mass")


class FragmentCountsTable(Table):
    """Fragments counted in a test, by mass: what the file that `mean_mass` names holds. The program fills it in."""

    stage: ClassVar = FragmentCounts
    source: str = Field(min_length=1)
    """The file."""
    edges: Annotated[
        list[Annotated[float, Quantity("kg", "0.5 g", minimum=0.0)]],
        Bounds(0.0, 1e4, "a fragment, not a round"),
        _GROUPS,
    ] = Field(min_length=1)
    """Rising edges of the groups of mass: as many as groups where the last has no upper end, or one more."""
    number: Annotated[list[float], Bounds(0.0, 1e9, "pieces that somebody counted"), _GROUPS] = Field(min_length=1)
    """Pieces of each group, of all rounds together."""
    mass: Annotated[
        list[Annotated[float, Quantity("kg", "12 g", minimum=0.0)]] | None,
        Bounds(0.0, 1e5, "fragments of some rounds"),
        _GROUPS,
    ] = None
    """Mass of the pieces of each group, where they were weighed."""
    rounds: Annotated[float, Bounds(1e-4, 1e4, "rounds of a test, or the part of one")] = 1.0
    """Rounds that the pieces come from; below 1: the part of one round whose fragments were caught."""
    scale: Annotated[float, Bounds(1e-3, 1e3, "a factor of uncertainty")] = 1.0
    """Factor on the fitted mean masses, for studies of their uncertainty."""


class BreakUpTable(Table, BreakUpSettings):
    """Mott's law per segment, its sampler, and the velocity that fragments inherit (Eqs. 19-31)."""

    NO_KEYS: ClassVar = ("random_roll", "shape_factor")
    ORDER: ClassVar = ("realisations", "dimension", "mixed_fraction", "mean_mass", "counts")
    realisations: int = Field(default=32, ge=1, le=100_000)
    """Fewest times that the casings are broken up at random; `fly` adds more up to hazard.max_realisations."""
    mean_mass: Annotated[float | str, _MEAN_MASS, MEAN_MASS] = BreakUpSettings.mean_mass  # type: ignore[assignment]
    """Law of the mean fragment mass (Eq. 21, Mott's of 1947, or Gurney and Sarmousakis), the mean itself, or a .csv
    file of the fragments that a test of this round counted, to which the mean masses of Eq. 21 are fitted."""
    counts: FragmentCountsTable | None = None
    """What the file of `mean_mass` holds; the program fills it in."""
    segments: Annotated[list[Length] | None, Entries(1000, "segments of a casing")] = None  # type: ignore[assignment]
    """Stations at which every casing is cut into segments; left out: the segments of its profile."""

    @property
    def mean_mass_is_file(self) -> bool:
        """Whether the mean mass is fitted to the fragments of a file."""
        return _MEAN_MASS.is_file(self.mean_mass)
