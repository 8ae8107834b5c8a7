"""The tables [flight], [[witness]] and [hazard]: how fragments fly and what is counted."""

from __future__ import annotations

from typing import Annotated, ClassVar, Literal

from pydantic import Discriminator, Field, Tag

from flight.hazard.criteria import Criteria
from flight.integrate.contact import Contact
from flight.integrate.job import Steps
from flight.scene.air import STANDARD_GRAVITY, AirLaw
from flight.scene.targets import Cylinder, Panel, Polygon
from flight.scene.wind import WindLaw
from flight.shape import Box
from fragfield.case.tables.base import Table, by_kind, name_or_table
from fragfield.case.tables.surroundings import GroundTable
from fragfield_base.bounds import Bounds, Entries, OnlyWith
from fragfield_base.inputs import (
    Density,
    FrictionAngle,
    Length,
    Offset,
    Position,
    PositiveLength,
    Quantity,
    Time,
)
from fragfield_base.units import degrees
from transition.settings import SHAPE_FACTOR, BreakUpSettings


def _name_or_number(value: object) -> str:
    return "<name>" if isinstance(value, str) else "<number>"


class AirTable(Table, AirLaw):
    """The air that fragments fly through."""


class WindTable(Table, WindLaw):
    """Horizontal wind."""


class IntegratorTable(Table, Steps):
    """How trajectories are integrated."""


_BOX = OnlyWith("model", ("box",))


class ShapeTable(Table):
    """Presented areas that differ from fragment to fragment."""

    model: Literal["mean", "lognormal", "box"] = "mean"
    """The mean area by `flight.shape_factor`, factors drawn about it, or boxes."""
    spread: Annotated[
        float | None,
        Bounds(0.0, 2.0, "a logarithm"),
        OnlyWith("model", ("lognormal",), refused=True, needed=("lognormal",), example="spread = 0.2"),
    ] = None
    """For model = "lognormal": standard deviation of the logarithm of the factor; an assumption, no law is known."""
    ratios: Annotated[list[float], Bounds(1e-3, 1000.0, "ratios of edges, not of atoms", usual=(0.1, 50.0)), _BOX] = (
        Field(default=[*Box.ratios], min_length=3, max_length=3)
    )
    """For model = "box": ratios of the edges."""
    density: Annotated[Density, Bounds(100.0, 2.5e4, "densities of casings", usual=(1000.0, 2e4)), _BOX] = Box.density
    """For model = "box": of the casing."""


class CollisionsTable(Table, Contact):
    """Contact between fragments of different rounds in the first metres, where their clouds cross."""

    NO_KEYS: ClassVar = ("friction_angle_deg", "min_speed", "duration", "between")
    ORDER: ClassVar = ("density", "restitution", "friction_angle")
    friction_angle: FrictionAngle = degrees(Contact.friction_angle_deg)
    """Of fragment on fragment."""


class FlightTable(Table):
    """How fragments fly."""

    air: AirTable = AirTable()
    wind: WindTable = WindTable()
    gravity: Annotated[
        float,
        Quantity("m/s^2", "9.80665 m/s^2", minimum=0.0),
        Bounds(0.0, 100.0, "ten times the Earth's", usual=(0.0, 9.9)),
    ] = STANDARD_GRAVITY
    """Downward acceleration."""
    drag: Annotated[
        Annotated[str, Tag("<name>")] | Annotated[float, Tag("<number>")],
        Discriminator(_name_or_number),
        Bounds(0.0, 100.0, "coefficients of bodies lie below 3", usual=(0.0, 3.0)),
    ] = "shell_fragment"
    """Drag coefficient over the Mach number: a built-in table, a .csv file, or a constant coefficient."""
    drag_factor: Annotated[float, Bounds(1e-3, 1000.0, "factors on a measured coefficient", usual=(0.5, 2.0))] = 1.0
    """Factor on the drag coefficient at every Mach number, for studies of its uncertainty."""
    shape_factor: Annotated[Density, SHAPE_FACTOR] = BreakUpSettings.shape_factor
    """k in the presented area (m / k)^(2/3): 2600 kg/m3 forged-steel shells, 3147 the 5:2:1 box."""
    shape: ShapeTable = ShapeTable()
    collisions: Annotated[
        Annotated[Literal["none"], Tag("<name>")] | Annotated[CollisionsTable, Tag("<table>")],
        Discriminator(name_or_table),
    ] = CollisionsTable()
    """Contact between fragments of different rounds, or "none"."""
    arena_mass: Literal["checked", "scaled", "as_given"] = "checked"
    """Mass of an arena table that is flown instead of a break-up: checked against that of the casing (50 to 110 %), its
    numbers scaled to the casing, or flown as given whatever was recovered."""
    ground: GroundTable = GroundTable()
    integrator: IntegratorTable = IntegratorTable()
    time_limit: Annotated[Time, Bounds(1e-6, 1e5, "no flight lasts a day")] = 3600.0
    """End of every flight."""
    origin: Offset = (0.0, 0.0)
    """x and y of the position from which distances and azimuths on the ground are counted."""
    trajectories: Annotated[int, Bounds(0, 100000, "ParaView shows no more")] = 200
    """Number of trajectories kept for ParaView, spread over the fragments."""


class CylinderTable(Table, Cylinder):
    """A vertical witness cylinder."""

    ORDER: ClassVar = ("name", "kind")
    name: str = Field(min_length=1)
    """A name of its own."""
    kind: Literal["cylinder"] = "cylinder"
    """A vertical cylinder."""
    bottom: Length | None = None  # type: ignore[assignment]
    top: Length | None = None  # type: ignore[assignment]


class PanelTable(Table, Panel):
    """A plane rectangular witness panel."""

    ORDER: ClassVar = ("name", "kind")
    name: str = Field(min_length=1)
    """A name of its own."""
    kind: Literal["panel"]
    """A plane rectangle."""


class PolygonTable(Table):
    """A plane polygonal witness panel."""

    stage: ClassVar = Polygon
    name: str = Field(min_length=1)
    """A name of its own."""
    kind: Literal["polygon"]
    """A plane polygon, convex or not."""
    corners: Annotated[list[Position], Entries(1000, "corners of a panel")] = Field(min_length=3)
    """Its corners in order."""


WitnessTable = Annotated[
    Annotated[CylinderTable, Tag("<cylinder>")]
    | Annotated[PanelTable, Tag("<panel>")]
    | Annotated[PolygonTable, Tag("<polygon>")],
    by_kind("cylinder"),
]


class StackRuleTable(Table):
    """The rule of TP-12 for stacks, shown beside every result of several equal rounds: how it counts them."""

    cover: Literal["open", "earth"] = "open"
    """Open stack, 0.9 of the rounds on a side and 0.1 of those on top; under earth cover 0.7 and 0.1."""
    side: Annotated[int | None, Bounds(0, 1e6, "rounds of a stack")] = None
    """Rounds on the side that faces the position; left out: on the fullest side, counted from their positions."""
    top: Annotated[int | None, Bounds(0, 1e6, "rounds of a stack")] = None
    """Rounds in the top layer; left out: counted from their positions."""


class HazardTable(Table, Criteria):
    """What counts as hazardous."""

    ORDER: ClassVar = ("energy", "density", "sectors", "distance_cell", "kernel", "tolerance", "max_realisations")
    sectors: Annotated[int, Bounds(1, 3600, "sectors narrower than 0.1 degree hold no fragments")] = 72
    """Azimuth sectors; 72 are 5 degrees each, the first centred on +x."""
    distance_cell: Annotated[
        PositiveLength, Bounds(0.01, 1e4, "cells below 1 cm hold no fragments", usual=(0.5, 100.0))
    ] = 10.0
    """The density is counted in cells a tenth as wide, or of 2 % of their distance where that is wider."""
    kernel: Annotated[
        float,
        Quantity("rad", "10 deg", above=0.0, maximum=3.2),
        Bounds(1e-3, 3.2, "narrower than any jet holds fragments", usual=(0.02, 3.2)),
    ] = degrees(10.0)
    """Half-width of the raised cosine that smooths the density over azimuth where directions differ: narrower than the
    jets between neighbouring rounds (about 10 degrees to either side), wide enough to hold many fragments."""
    tolerance: float = Field(default=0.02, gt=0.0, lt=1.0)
    """Realisations are added until standard error and bias bound of the hazard distance are below this part of it;
    weighted fragments are in inverse proportion to it."""
    max_realisations: int = Field(default=500, ge=1, le=100_000)
    """Realisations beyond which none are added; break_up.realisations is the fewest."""
    protective_works: list[str] = Field(default_factory=list)
    """Names of the obstacles and wall planes that enclose the rounds, for rules that know protective works; no other
    wall, deck or building counts as such."""
    stack_rule: StackRuleTable = StackRuleTable()
    """How the rule of DDESB TP-12 counts the rounds of a stack."""
