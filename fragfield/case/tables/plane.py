"""The tables [[plane]]: rigid planes and planes of symmetry."""

from __future__ import annotations

import math
from typing import Annotated, Literal

from pydantic import Field

from fragfield.case.tables.base import Table
from fragfield_base.inputs import Direction, FrictionAngle, Length, OnlyWith, Position, degrees

__all__ = ["PlaneTable", "resolved_plane"]

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
