"""The table [stack]: copies of one round in the arrangements of storage."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Annotated, Literal

from fragfield.case.tables.base import Table
from fragfield.case.tables.round import StandsOn
from fragfield_base.inputs import Bounds, Entries, OnlyWith, Parsed, Quantity

__all__ = ["StackTable"]

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
        Bounds(0.0, 1e3, "farther apart rounds are no stack", usual=(0.0, 10.0)),
    ]
    """Clear distance between neighbours, at their largest diameters; 0 mm: as near as their meshes allow."""
    layer_gap: Annotated[
        float | None,
        Quantity("m", "50 mm", minimum=0.0),
        Bounds(0.0, 1e3, "farther apart rounds are no stack", usual=(0.0, 10.0)),
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
