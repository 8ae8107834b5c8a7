"""The tables [stack] and [[plane]]: copies of one round in the arrangements of storage; rigid planes."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from pydantic import Field

from fragfield.case.tables.base import Table
from fragfield.case.tables.round import StandsOn
from fragfield_base.inputs import (
    Bounds,
    Direction,
    Entries,
    FrictionAngle,
    Length,
    OnlyWith,
    Parsed,
    Position,
    Quantity,
    degrees,
)

__all__ = ["PlaneTable", "StackTable", "resolved_plane"]

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
    """z of the deck on which the lowest layer stands, or "ground"; left out: as the round that is copied."""
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
