"""The body of the 105 mm M1 as drawings: a DXF of its half section, as people draw it."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, NamedTuple

import ezdxf

from burst_fenicsx.geometry import load_profile

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence
    from pathlib import Path

__all__ = ["CHARGE", "SHELL", "Corner", "outline", "write_dxf"]

SHELL = load_profile("m1_105")
CHARGE = {"charge_front": "50 mm", "fuze": "0.192 kg"}
"""What no drawing of the casing says."""


class Corner(NamedTuple):
    """A corner (mm) and the bulge of the line that leaves it: the tangent of a quarter of its arc's angle."""

    x: float
    y: float
    bulge: float = 0.0


def outline() -> list[Corner]:
    """The closed outline of the casing's half section, nose left, axis y = 0."""
    made = _line(SHELL.outer.stations, SHELL.outer.radii, SHELL.outer.arcs)
    back = _line(SHELL.cavity.stations, SHELL.cavity.radii, SHELL.cavity.arcs)
    bulges = [-one.bulge for one in back[-2::-1]] + [0.0]
    base = [Corner(made[-1].x, 0.0), Corner(back[-1].x, 0.0)]
    return [*made, *base, *(Corner(one.x, one.y, bulge) for one, bulge in zip(back[::-1], bulges, strict=True))]


def _line(stations: Sequence[float], radii: Sequence[float], arcs: Sequence[float]) -> list[Corner]:
    points = [(1e3 * s, 1e3 * r) for s, r in zip(stations, radii, strict=True)]
    made = []
    for start, end, arc in zip(points, points[1:], arcs, strict=False):
        bulge = (
            0.0 if not arc else -math.copysign(math.tan(0.5 * math.asin(math.dist(start, end) / abs(2e3 * arc))), arc)
        )
        made.append(Corner(*start, bulge))
    return [*made, Corner(*points[-1])]


def write_dxf(
    path: Path,
    draw: Callable[[ezdxf.document.Drawing, list[Corner]], None] | None = None,
    *,
    units: int = 4,
    release: str = "R2010",
) -> Path:
    """Write a DXF: the outline as one polyline on layer CASING with a centre line, or as `draw` draws its corners."""
    document = ezdxf.new(release, setup=True)
    document.header["$INSUNITS"] = units
    for layer in ("CASING", "AXIS", "NOTES"):
        document.layers.add(layer)
    if draw is None:
        polyline(document, outline())
        document.modelspace().add_line((-10, 0), (400, 0), dxfattribs={"layer": "AXIS", "linetype": "CENTER"})
    else:
        draw(document, outline())
    document.saveas(path)
    return path


def polyline(document, corners, layer="CASING", **more):
    """The outline as a closed polyline with bulges."""
    space = document.modelspace()
    add = space.add_polyline2d if document.dxfversion < "AC1015" else space.add_lwpolyline
    return add([tuple(one) for one in corners], format="xyb", close=True, dxfattribs={"layer": layer, **more})
