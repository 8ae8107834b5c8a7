"""The tables [[round]], [stack] and [[plane]]: cased charges, their materials, copies of them, rigid planes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import Discriminator, Field, Tag

from burst_fenicsx.problem import CasingMaterial, Explosive, IgnitionPoint, JonesWilkinsLee, Round, ShockInitiation
from fragfield.case.tables.base import Table, name_or_table
from fragfield_base.bounds import Bounds, Entries, OnlyWith
from fragfield_base.inputs import (
    Angle,
    Direction,
    FrictionAngle,
    Length,
    NumberOrWord,
    Parsed,
    Position,
    Quantity,
)
from fragfield_base.units import degrees, read_measure

Attitude = Annotated[
    float | str | None, Quantity("rad", "30 deg", minimum=0.0, maximum=math.pi, words=("upright", "lying", "any"))
]
StandsOn = Annotated[float | str | None, Quantity("m", "0 m", words=("ground",))]
SofteningStrain = Annotated[
    float | str, NumberOrWord(("none",), 0.5), Bounds(1e-4, 1e3, "strains at rupture", usual=(0.01, 10.0))
]


ProfileValue = Annotated[
    Annotated[str, Tag("<name>")] | Annotated[dict[str, Any], Tag("<table>")], Discriminator(name_or_table)
]


UnitOfFile = Annotated[
    float | str | None,
    Quantity("m", "1 mm", above=0.0, words=("mm", "cm", "m", "in", "ft")),
    Bounds(1e-9, 1e3, "from nanometres to kilometres"),
]
"""Length of one unit of a file: its name, or a length."""


class JwlTable(Table, JonesWilkinsLee):
    """Constants of the law of Jones, Wilkins and Lee: P over the relative volume V, with its own energy E."""


class ExplosiveTable(Table, Explosive):
    """An explosive with its constants."""

    jwl: JwlTable | None = None
    """Constants for products = "jwl"."""


class CasingTable(Table, CasingMaterial):
    """A casing material: Tresca with linear softening and tension cut-off (Eqs. 8-11)."""

    shear_softening_strain: SofteningStrain = CasingMaterial.shear_softening_strain  # type: ignore[assignment]
    """Equivalent plastic shear strain at which tau_c is zero, or "none"."""
    tensile_softening_strain: SofteningStrain = CasingMaterial.tensile_softening_strain  # type: ignore[assignment]
    """Plastic volumetric strain at which sigma_t is zero, or "none"."""
    softening_length: Annotated[
        float | str,
        Quantity("m", "3 mm", above=0.0, words=("none",)),
        Bounds(1e-6, 1.0, "lengths of cells", usual=(1e-4, 0.03)),
    ] = "none"  # type: ignore[assignment]
    """Scales the softening strains by this length over the cell's, for the energy of a tear one cell wide; "none": not
    scaled, as suits a casing that stretches evenly."""


class IgnitionTable(Table, IgnitionPoint):
    """A point that initiates the charge."""

    station: Annotated[
        float | str,
        Quantity("m", "30 mm", words=("nose", "middle", "base")),
        Bounds(-100.0, 100.0, "no round is 100 m long"),
    ] = "nose"  # type: ignore[assignment]
    """Position along the axis from the round's nose end; or the nose end, the middle or the base end of the charge."""


class InitiationTable(Table, ShockInitiation):
    """Initiation of the charge by the shock of a neighbour: every cell pressed hard and long enough ignites."""

    pressure: Annotated[
        float | None,
        Quantity("Pa", "5 GPa", above=0.0),
        Bounds(1e5, 1e12, "shocks that initiate have 0.5 to 50 GPa", usual=(1e8, 5e10)),
    ] = None  # type: ignore[assignment]
    """Pressure that a cell must hold; left out: no pressure initiates it, and only what the shock does is reported."""


class ExpectedTable(Table):
    """Masses that the drawing gives: those of the contours and materials must be within 1 % of them."""

    casing: Annotated[float | None, Quantity("kg", "34.5 kg", above=0.0)] = None
    """Mass of the casing."""
    charge: Annotated[float | None, Quantity("kg", "6.86 kg", above=0.0)] = None
    """Mass of the charge."""


def length_of(unit: float | str | None) -> float | None:
    """Length (m) of a `UnitOfFile`."""
    return read_measure(unit).value if isinstance(unit, str) else unit


class ContourTable(Table):
    """A contour of the casing from a drawing or a table of diameters, in place of a profile."""

    file: str = Field(min_length=1)
    """A section in DXF, half of it or both halves, or a table of diameters or radii (.csv, .xlsx)."""
    unit: UnitOfFile = None
    """Length of one unit of the file; left out: as the file says, and refused where it does not."""
    layers: list[str] | None = Field(default=None, min_length=1)
    """Layers that hold the outline of the casing; left out: all."""
    axis: str | None = None
    """The axis in units of the file, such as "y = 0" or "x = 12.5"; left out: the centre line, or where it is clear."""
    nose: Literal["left", "right", "top", "bottom", "first", "last"] | None = None
    """Side of the nose, in a table its "first" or "last" station; left out: the narrower end."""
    tolerance: Annotated[float, Quantity("m", "0.01 mm", above=0.0), Bounds(1e-7, 1e-3, "a wall has millimetres")] = (
        1e-5
    )
    """By which chords may be off the curves of the drawing."""
    gap: Annotated[float, Quantity("m", "0.1 mm", above=0.0), Bounds(1e-6, 5e-3, "a wall has millimetres")] = 1e-4
    """Gaps up to this one are closed; larger ones are refused."""
    charge_front: Annotated[float | None, Quantity("m", "80 mm", minimum=0.0)] = None
    """Station up to which the charge fills the cavity, from its base end; left out: it fills all of it."""
    fuze: Annotated[float | str | None, Quantity("kg", "1.2 kg", above=0.0, words=("void",))] = None
    """Mass of what fills the cavity before the charge, or "void"."""

    @property
    def unit_length(self) -> float | None:
        """Length of one unit of the file (m)."""
        return length_of(self.unit)


class RoundTable(Table):
    """One cased charge in space."""

    name: str = Field(min_length=1)
    """A name of its own."""
    profile: ProfileValue | None = None
    """Contours: a built-in name, a profile file, or the profile's tables themselves."""
    contour: (
        Annotated[Annotated[str, Tag("<name>")] | Annotated[ContourTable, Tag("<table>")], Discriminator(name_or_table)]
        | None
    ) = None
    """A drawing or a table of diameters, instead of a profile: a file, or a table that says how it is read."""
    mesh: str | None = None
    """A gmsh file of hexahedra with the physical groups "charge" and "casing", instead of a profile."""
    mesh_unit: Literal["m", "cm", "mm", "in"] | None = None
    """Unit of the numbers in the mesh file, which names none; left out: m."""
    explosive: Annotated[
        Annotated[str, Tag("<name>")] | Annotated[ExplosiveTable, Tag("<table>")], Discriminator(name_or_table)
    ]
    """A built-in name (any of a substance's names), a file, or a table."""
    casing: Annotated[
        Annotated[str, Tag("<name>")] | Annotated[CasingTable, Tag("<table>")], Discriminator(name_or_table)
    ]
    """A built-in name (any of a substance's names), a file, or a table."""
    expected: ExpectedTable | None = Field(
        default=None, json_schema_extra={"inline": '{ casing = "34.5 kg", charge = "6.86 kg" }'}
    )
    """Masses from the drawing of the round, against which contours and materials are checked (1 %): this finds
    diameters given for radii, and wrong units. Give them wherever the drawing has them."""
    position: Position = Round.position
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
    axis: Direction = Field(default=Round.axis, json_schema_extra={"instead_of": "attitude"})
    """Direction from the base to the nose, z up, instead of `attitude`."""
    ignition: Annotated[list[IgnitionTable] | None, Entries(200, "more points than a charge has places")] = None
    """Ignition points; left out: one at the nose end of the charge, on the axis. Empty: by `initiation` alone."""
    initiation: InitiationTable | None = None
    """Initiation by a neighbour's shock, besides the ignition points; left out: by them alone."""

    def material(self, kind: Literal["explosive", "casing"]) -> Any:  # noqa: ANN401 - the one or the other
        """The stage's explosive or casing of a resolved round."""
        return getattr(self, kind).made()


_GAP = Bounds(0.0, 1e3, "farther apart rounds are no stack", usual=(0.0, 10.0))
_COUNT = Bounds(1, 1000, "a stack of more rounds is not computed whole")


@dataclass(frozen=True)
class _Counts(Parsed):
    """Numbers of rounds along x, along y and of layers."""

    allowed: str = "three whole numbers of 1 or more, along x, along y and of layers, for example [2, 4, 1]"

    def parse(self, value: object) -> tuple[int, int, int]:
        """Read three whole numbers."""
        if not isinstance(value, (list, tuple)) or len(value) != 3:
            raise self.refuse(value)
        if any(isinstance(count, bool) or not isinstance(count, int) or count < 1 for count in value):
            raise self.refuse(value)
        return (value[0], value[1], value[2])


@dataclass(frozen=True)
class _Reference(Parsed):
    """A round of the stack, by its name or its number from 1."""

    allowed: str = 'a round of the stack by its name, for example "shell_1", or by its number from 1'

    def parse(self, value: object) -> str | int:
        """Read a name or a number."""
        if isinstance(value, str) or (isinstance(value, int) and not isinstance(value, bool) and value >= 1):
            return value
        raise self.refuse(value)


class StackTable(Table):
    """Copies of one round, named NAME_1, NAME_2, ..., evenly about the x and y of its position.

    "row": `count` rounds along x. "triangle": rounds in each other's grooves, in rows of `count`, `count` - 1, ..., 1;
    upright ones as an equilateral triangle seen from above, lying ones as a pyramidal pile. "pallet": `counts` along
    x, along y and of layers.
    """

    arrangement: Literal["row", "triangle", "pallet"]
    """How the rounds stand to each other."""
    round: str | None = None
    """Name of the round that is copied; left out: the only one."""
    count: Annotated[
        int | None,
        _COUNT,
        OnlyWith("arrangement", ("row", "triangle"), refused=True, needed=("row",), example="count = 4"),
    ] = None
    """Rounds of a row, or of the first row of a triangle (left out: 2, which gives three rounds)."""
    counts: Annotated[
        tuple[int, int, int] | None,
        _Counts(),
        _COUNT,
        OnlyWith("arrangement", ("pallet",), refused=True, needed=("pallet",)),
    ] = None
    """Rounds of a pallet along x, along y and of layers."""
    gap: Annotated[
        float,
        Quantity("m", "21.7 mm", minimum=0.0),
        _GAP,
    ]
    """Clear distance between neighbours, at their largest diameters; 0 mm: as near as their meshes allow."""
    layer_gap: Annotated[
        float | None,
        Quantity("m", "50 mm", minimum=0.0),
        _GAP,
        OnlyWith("arrangement", ("pallet",), refused=True),
    ] = None
    """Clear distance between the layers of a pallet; left out: `gap`."""
    base: StandsOn = None
    """z of the deck on which the lowest layer stands, or "ground": that at the x and y of each round; left out: as the
    round that is copied."""
    delays: Annotated[
        list[Annotated[float, Quantity("s", "5 us", minimum=0.0)]] | None,
        Bounds(0.0, 0.1, "a burst is over within milliseconds"),
        Entries(10000, "one for each round"),
    ] = None
    """One time for each round, added to the delays of its ignition points; left out: none."""
    initiated: list[Annotated[str | int, _Reference()]] | None = None
    """Rounds that have the ignition points, by name or number; the others wait for the shock. Left out: all."""

    @property
    def size(self) -> int:
        """Number of rounds."""
        if self.arrangement == "triangle":
            base = self.count if self.count is not None else 2
            return base * (base + 1) // 2
        return (self.count or 1) if self.arrangement == "row" else math.prod(self.counts or (1,))


UP = (0.0, 0.0, 1.0)
FRICTION_ANGLE = degrees(20.0)
UNIT = 1e-12  # a normal this near to unit length stays as it is, so that reading it again changes nothing


class PlaneTable(Table):
    """A plane that no casing passes."""

    name: str = Field(min_length=1)
    """A name of its own."""
    kind: Literal["ground", "symmetry", "wall"]
    """Level ground; a plane of symmetry, which stands for the mirrored rounds behind it; or a barricade or a deck."""
    height: Annotated[Length | None, OnlyWith("kind", ("ground",), refused=True)] = None
    """z of a level ground; left out: 0 m, or that of `point`."""
    point: Annotated[Position | None, OnlyWith("kind", without=(), needed=("wall",))] = None
    """A point of the plane; needed by a wall, for a plane of symmetry left out: the origin."""
    normal: Direction | None = None
    """Direction from the plane to the rounds; left out: upwards, for the ground alone."""
    friction_angle: Annotated[FrictionAngle | None, OnlyWith("kind", ("ground", "wall"), refused=True)] = None
    """Of casings on it; left out: 20 degrees. A plane of symmetry has none."""


def resolved_plane(entry: PlaneTable) -> PlaneTable:
    """Spell point, unit normal and friction out; the entry must have passed the checks."""
    normal = entry.normal if entry.normal is not None else UP
    length = math.hypot(*normal)
    if abs(length - 1.0) > UNIT:
        normal = (normal[0] / length, normal[1] / length, normal[2] / length)
    friction = entry.friction_angle
    if friction is None and entry.kind != "symmetry":
        friction = FRICTION_ANGLE
    point = entry.point if entry.point is not None else (0.0, 0.0, entry.height or 0.0)
    return entry.model_copy(update={"height": None, "point": point, "normal": normal, "friction_angle": friction})
