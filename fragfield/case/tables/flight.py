"""The tables [flight], [[witness]] and [hazard]: how fragments fly and what is counted."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Discriminator, Field, Tag

from flight.constants import STANDARD_GRAVITY
from fragfield.case.tables.base import Table, by_kind, name_or_table
from fragfield.case.tables.ground import GroundTable
from fragfield.case.units.kinds import (
    Angle,
    ArealDensity,
    Density,
    Direction,
    Energy,
    FrictionAngle,
    Length,
    Offset,
    Position,
    PositiveLength,
    Speed,
    Time,
)
from fragfield.case.units.quantities import Quantity, degrees

__all__ = [
    "AirTable",
    "CollisionsTable",
    "CylinderTable",
    "FlightTable",
    "HazardTable",
    "IntegratorTable",
    "PanelTable",
    "PolygonTable",
    "StackRuleTable",
    "ShapeTable",
    "WindTable",
    "WitnessTable",
]


PositiveNumber = Annotated[float, Field(gt=0.0)]


def _name_or_number(value: object) -> str:
    return "<name>" if isinstance(value, str) else "<number>"


class AirTable(Table):
    """The air that fragments fly through."""

    model: Literal["standard", "constant"] = "standard"
    """The US Standard Atmosphere 1976, or one density everywhere."""
    altitude: Length = 0.0
    """Altitude of z = 0 above sea level, for model = "standard"."""
    density: Annotated[float | None, Quantity("kg/m^3", "1.225 kg/m^3", minimum=0.0)] = None
    """For model = "constant"; 0 is a vacuum."""
    sound_speed: Speed = 340.294
    """For model = "constant"."""


class WindTable(Table):
    """Horizontal wind."""

    model: Literal["constant", "power_law", "profile"] = "constant"
    """The same at all heights, growing with height, or given at heights."""
    speed: Annotated[float, Quantity("m/s", "5 m/s", minimum=0.0)] = 0.0
    """Speed; for model = "power_law" the one at `reference_height`."""
    towards: Angle = 0.0
    """Azimuth that the wind blows towards, from +x counter-clockwise."""
    reference_height: PositiveLength = 10.0
    """For model = "power_law"."""
    exponent: float = Field(default=1.0 / 7.0, gt=0.0, lt=1.0)
    """For model = "power_law"."""
    heights: list[Length] | None = None
    """For model = "profile": heights z, rising."""
    speeds: list[Annotated[float, Quantity("m/s", "5 m/s", minimum=0.0)]] | None = None
    """For model = "profile": one speed for each height."""
    directions: list[Angle] | None = None
    """For model = "profile": one azimuth for each height."""


class IntegratorTable(Table):
    """How trajectories are integrated."""

    method: Literal["adaptive", "fixed"] = "adaptive"
    """Embedded Runge-Kutta with a step of its own for every fragment, or a fixed step."""
    tolerance: float = Field(default=3e-8, ge=1e-14, le=1e-2)
    """Relative error of a step, for method = "adaptive"; 3e-8 keeps a range within 1e-6 of itself, 1e-6 within 4e-5."""
    step: Time = 1e-4
    """For method = "fixed" (the paper: 0.1 ms)."""


class ShapeTable(Table):
    """Presented areas that differ from fragment to fragment."""

    model: Literal["mean", "lognormal", "box"] = "mean"
    """The mean area by `flight.shape_factor`, factors drawn about it, or boxes."""
    spread: float | None = Field(default=None, ge=0.0, le=2.0)
    """For model = "lognormal": standard deviation of the logarithm of the factor; an assumption, no law is known."""
    ratios: list[PositiveNumber] = Field(default=[5.0, 2.0, 1.0], min_length=3, max_length=3)
    """For model = "box": ratios of the edges."""
    density: Density = 7800.0
    """For model = "box": of the casing."""


class CollisionsTable(Table):
    """Contact between fragments of different rounds in the first metres, where their clouds cross."""

    density: Density = 7850.0
    """Of the casing, for spheres of the fragments' volume."""
    restitution: float = Field(default=0.3, ge=0.0, le=1.0)
    """Speed of separation over speed of closing."""
    friction_angle: FrictionAngle = degrees(20.0)
    """Of fragment on fragment."""
    distance: PositiveLength = 5.0
    """From its launch up to which a fragment takes part."""
    time_limit: Time = 1.0
    """Up to which contact is looked for."""


class FlightTable(Table):
    """How fragments fly."""

    air: AirTable = AirTable()
    wind: WindTable = WindTable()
    gravity: Annotated[float, Quantity("m/s^2", "9.80665 m/s^2", minimum=0.0)] = STANDARD_GRAVITY
    """Downward acceleration."""
    drag: Annotated[
        Annotated[str, Tag("<name>")] | Annotated[float, Tag("<number>")], Discriminator(_name_or_number)
    ] = "shell_fragment"
    """Drag coefficient over the Mach number: a built-in table, a .csv file, or a constant coefficient."""
    drag_factor: float = Field(default=1.0, gt=0.0)
    """Factor on the drag coefficient at every Mach number, for studies of its uncertainty."""
    shape_factor: Density = 2600.0
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
    time_limit: Time = 3600.0
    """End of every flight."""
    origin: Offset = (0.0, 0.0)
    """x and y of the position from which distances and azimuths on the ground are counted."""
    trajectories: int = Field(default=200, ge=0)
    """Number of trajectories kept for ParaView, spread over the fragments."""


class CylinderTable(Table):
    """A vertical witness cylinder."""

    name: str = Field(min_length=1)
    """A name of its own."""
    kind: Literal["cylinder"] = "cylinder"
    """A vertical cylinder."""
    radius: PositiveLength
    """Radius."""
    centre: Offset = (0.0, 0.0)
    """x and y of its axis."""
    bottom: Length | None = None
    """z of the lower rim; left out: unbounded."""
    top: Length | None = None
    """z of the upper rim; left out: unbounded."""


class PanelTable(Table):
    """A plane rectangular witness panel."""

    name: str = Field(min_length=1)
    """A name of its own."""
    kind: Literal["panel"]
    """A plane rectangle."""
    centre: Position
    """Its centre."""
    normal: Direction
    """Its normal."""
    width: PositiveLength
    """Across `up`."""
    height: PositiveLength
    """Along `up`."""
    up: Direction = (0.0, 0.0, 1.0)
    """Direction of its height."""


class PolygonTable(Table):
    """A plane polygonal witness panel."""

    name: str = Field(min_length=1)
    """A name of its own."""
    kind: Literal["polygon"]
    """A plane polygon, convex or not."""
    corners: list[Position] = Field(min_length=3)
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
    side: int | None = Field(default=None, ge=0)
    """Rounds on the side that faces the position; left out: on the fullest side, counted from their positions."""
    top: int | None = Field(default=None, ge=0)
    """Rounds in the top layer; left out: counted from their positions."""


class HazardTable(Table):
    """What counts as hazardous."""

    energy: Energy = 79.0
    """A fragment with this energy or more at impact is hazardous (58 ft lb)."""
    density: ArealDensity = 1.0 / 55.7
    """Acceptable number of hazardous fragments per area (one per 600 ft2)."""
    sectors: int = Field(default=72, ge=1)
    """Azimuth sectors; 72 are 5 degrees each, the first centred on +x."""
    distance_cell: PositiveLength = 10.0
    """The density is counted in cells a tenth as wide, or of 2 % of their distance where that is wider."""
    kernel: Annotated[float, Quantity("rad", "10 deg", above=0.0, maximum=3.2)] = degrees(10.0)
    """Half-width of the raised cosine that smooths the density over azimuth where directions differ: narrower than the
    jets between neighbouring rounds (about 10 degrees to either side), wide enough to hold many fragments."""
    tolerance: float = Field(default=0.02, gt=0.0, lt=1.0)
    """Realisations are added until standard error and bias bound of the hazard distance are below this part of it."""
    max_realisations: int = Field(default=500, ge=1, le=100_000)
    """Realisations beyond which none are added; break_up.realisations is the fewest."""
    person_area: Annotated[float, Quantity("m^2", "0.58 m^2", above=0.0)] = 0.58
    """Area of a person that a fragment may hit."""
    person_height: Annotated[float, Quantity("m", "1.8 m", minimum=0.0)] = 1.8
    """Height of a person: a fragment passing lower may hit."""
    stack_rule: StackRuleTable = StackRuleTable()
    """How the rule of DDESB TP-12 counts the rounds of a stack."""
