"""Witness surfaces: they record every fragment that crosses them and stop none.

Lengths in m. The case's tables [[witness]] are made from the dataclasses, but for those of polygons. At the end stands
what is done with polygons in plan, whose corners (k, 2) are in order, not closed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

import numpy as np

from flight.arguments import Size, real_array, require_number, require_numbers
from flight.errors import InputError
from fragfield_base.bounds import Bounds
from fragfield_base.inputs import Direction, Length, Offset, Position, PositiveLength

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray


CYLINDER, RECTANGLE, POLYGON, GROUP, COLUMNS = 0, 1, 2, 3, 25  # as in flight.kernels.faces
SLACK = 1e-9  # by which boxes are wider than their surface, relative and in m: rounding must not cut an edge off


@dataclass(frozen=True)
class Cylinder:
    """A vertical cylinder (a witness ring)."""

    radius: Annotated[PositiveLength, Bounds(1e-3, 1e5, "no fragment flies as far as 100 km")]
    """Radius."""
    centre: Offset = (0.0, 0.0)
    """x and y of its axis."""
    bottom: Length = -math.inf
    """z of the lower rim; left out: unbounded."""
    top: Length = math.inf
    """z of the upper rim; left out: unbounded."""
    name: str = "cylinder"

    def __post_init__(self) -> None:
        require_number(f"witness {self.name}", "radius", self.radius, "m", above=0.0)
        require_numbers(f"witness {self.name}", self, {"bottom": "m", "top": "m"})
        real_array(f"witness {self.name}", "centre", self.centre, "m", (2,))
        if not self.bottom < self.top:
            raise InputError(f"witness {self.name}: bottom {self.bottom} m is not below top {self.top} m")

    @property
    def area(self) -> float:
        """Area (m2), infinite over all heights."""
        return 2.0 * math.pi * self.radius * (self.top - self.bottom)


@dataclass(frozen=True)
class Panel:
    """A plane rectangle."""

    centre: Position
    """Its centre."""
    normal: Direction
    """Its normal."""
    width: Size
    """Across `up`."""
    height: Size
    """Along `up`."""
    up: Direction = (0.0, 0.0, 1.0)
    """Direction of its height."""
    name: str = "panel"

    def __post_init__(self) -> None:
        for what, unit in (("centre", "m"), ("normal", ""), ("up", "")):
            real_array(f"witness {self.name}", what, getattr(self, what), unit, (3,))
        require_numbers(f"witness {self.name}", self, {"width": "m", "height": "m"}, above=0.0)
        self.axes()

    @property
    def area(self) -> float:
        """Area (m2)."""
        return self.width * self.height

    def axes(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Unit normal, unit vector along the width and unit vector along the height."""
        normal = _unit(self.name, "normal", np.asarray(self.normal, dtype=np.float64))
        up = np.asarray(self.up, dtype=np.float64)
        across = np.cross(up, normal)
        if np.linalg.norm(across) <= 1e-9 * np.linalg.norm(up):
            raise InputError(
                f"witness {self.name}: up {[*self.up]} is along the normal "
                f"{[*self.normal]}; a level panel needs another up"
            )
        across = _unit(self.name, "up", across)
        return normal, across, np.cross(normal, across)


@dataclass(frozen=True, eq=False)
class Polygon:
    """A plane polygon, convex or not: corners (n, 3) in order (m), at least three, in one plane to 1e-6 of its size."""

    corners: NDArray[np.float64]
    name: str = "polygon"

    def __init__(self, corners: ArrayLike, name: str = "polygon") -> None:
        """Take the corners as anything NumPy can read."""
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "corners", real_array(f"witness {name}", "corners", corners, "m").copy())
        if self.corners.ndim != 2 or self.corners.shape[1] != 3 or len(self.corners) < 3:
            raise InputError(
                f"witness {name}: corners have shape {self.corners.shape}, needed (n, 3) with n of 3 or more"
            )
        if not np.isfinite(self.corners).all():
            raise InputError(f"witness {name}: a corner is not a finite number")
        normal, _, _ = self.axes()
        off = float(np.abs((self.corners - self.corners.mean(axis=0)) @ normal).max())
        size = float(np.ptp(self.corners, axis=0).max())
        if off > 1e-6 * size:
            raise InputError(f"witness {name}: the corners leave their plane by {off:.3g} m; split it into triangles")

    @property
    def area(self) -> float:
        """Area (m2)."""
        return float(np.linalg.norm(self._area_vector()))

    def axes(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.float64]]:
        """Unit normal and two unit vectors in the plane."""
        vector = self._area_vector()
        size = float(np.ptp(self.corners, axis=0).max())
        if not np.linalg.norm(vector) > 1e-12 * size**2:
            raise InputError(f"witness {self.name}: the corners enclose no area")
        normal = vector / np.linalg.norm(vector)
        along = np.eye(3)[int(np.argmin(np.abs(normal)))]
        first = _unit(self.name, "corners", np.cross(along, normal))
        return normal, first, np.cross(normal, first)

    def _area_vector(self) -> NDArray[np.float64]:
        rest = self.corners - self.corners[0]  # Newell's sum
        return np.asarray(0.5 * np.cross(rest, np.roll(rest, -1, axis=0)).sum(axis=0))


Witness = Cylinder | Panel | Polygon


def pack(witnesses: Sequence[Witness]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Rows (n, 25) for the kernels, and corners of polygons in their planes (m, 2).

    Before neighbouring witnesses of one name stands a row of their common box: what misses it misses them all.
    """
    rows = np.zeros((len(witnesses), COLUMNS))
    vertices: list[NDArray[np.float64]] = []
    count = 0
    for row, witness in zip(rows, witnesses, strict=True):
        if isinstance(witness, Cylinder):
            (x, y), r = witness.centre, witness.radius
            box = np.array([[x - r, x + r], [y - r, y + r], [witness.bottom, witness.top]])
            row[0], row[7:9] = CYLINDER, (x, y)
            row[10:13] = r, witness.bottom, witness.top
        else:
            normal, first, second = witness.axes()
            if isinstance(witness, Panel):
                point = np.asarray(witness.centre, dtype=np.float64)
                reach = 0.5 * (witness.width * np.abs(first) + witness.height * np.abs(second))
                box = np.stack([point - reach, point + reach], axis=1)
                row[0], row[19:21] = RECTANGLE, (0.5 * witness.width, 0.5 * witness.height)
            else:
                point = witness.corners.mean(axis=0)
                box = np.stack([witness.corners.min(axis=0), witness.corners.max(axis=0)], axis=1)
                outline = (witness.corners - point) @ np.stack([first, second], axis=1)
                row[0], row[21:23] = POLYGON, (count, count + len(outline))
                vertices.append(outline)
                count += len(outline)
            row[7:10], row[10:13], row[13:16], row[16:19] = point, normal, first, second
        finite = np.abs(box[np.isfinite(box)])
        slack = SLACK * (1.0 + (float(finite.max()) if finite.size else 0.0))
        row[1:7] = (box + slack * np.array([-1.0, 1.0])).ravel()
    rows[:, 23] = np.arange(len(rows))
    return _grouped(rows, witnesses), np.concatenate(vertices) if vertices else np.zeros((0, 2))


def within(witnesses: Sequence[Witness]) -> NDArray[np.float64]:
    """Box (6,) in which no witness is: inscribed in the narrowest of upright cylinders; empty among other surfaces."""
    box = np.array([np.inf, -np.inf] * 3)
    if not witnesses or not all(isinstance(witness, Cylinder) for witness in witnesses):
        return box
    inscribed = []
    for witness in witnesses:
        assert isinstance(witness, Cylinder)
        x, y = witness.centre
        half = witness.radius / math.sqrt(2.0) - SLACK * (1.0 + abs(x) + abs(y) + witness.radius)
        inscribed.append([x - half, x + half, y - half, y + half])
    each = np.array(inscribed)
    low, high = each[:, ::2].max(axis=0), each[:, 1::2].min(axis=0)
    box[0:4:2], box[1:4:2], box[4:] = low, high, (-np.inf, np.inf)
    return box


def _grouped(rows: NDArray[np.float64], witnesses: Sequence[Witness]) -> NDArray[np.float64]:
    made, start = [np.zeros((0, COLUMNS))], 0
    while start < len(rows):
        end = start + 1
        while end < len(rows) and witnesses[end].name == witnesses[start].name:
            end += 1
        if end - start > 1:
            head = np.zeros((1, COLUMNS))
            head[0, 0], head[0, 24] = GROUP, end - start
            head[0, 1:7:2], head[0, 2:7:2] = rows[start:end, 1:7:2].min(axis=0), rows[start:end, 2:7:2].max(axis=0)
            made.append(head)
        made.append(rows[start:end])
        start = end
    return np.ascontiguousarray(np.concatenate(made))


def _unit(witness: str, what: str, vector: NDArray[np.float64]) -> NDArray[np.float64]:
    size = float(np.linalg.norm(vector))
    if not size > 0.0:
        raise InputError(f"witness {witness}: {what} has no direction")
    return vector / size


_SAME = 1e-9  # in the unit of the corners: nearer ones are one


def signed_area(corners: NDArray[np.float64]) -> float:
    """Area, positive where the corners run counter-clockwise."""
    x, y = corners.T
    return 0.5 * float(np.dot(x, np.roll(y, -1)) - np.dot(y, np.roll(x, -1)))


def contains(corners: NDArray[np.float64], points: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Whether points (n, 2) lie inside, by the even-odd rule (Shimrat 1962)."""
    inside = np.zeros(len(points), dtype=bool)
    x, y = points.T
    for (ax, ay), (bx, by) in zip(corners.tolist(), np.roll(corners, -1, axis=0).tolist(), strict=True):
        crosses = (ay > y) != (by > y)
        with np.errstate(divide="ignore", invalid="ignore"):
            inside ^= crosses & (x < ax + (y - ay) * (bx - ax) / (by - ay))
    return inside


def clipped(corners: NDArray[np.float64], axis: int, bound: float, side: float) -> NDArray[np.float64]:
    """The part with side * (coordinate - bound) >= 0 along an axis, 0 or 1 (Sutherland and Hodgman 1974).

    Of a polygon that is not convex the parts hang together by edges along the bound.
    """
    kept: list[NDArray[np.float64]] = []
    for start, end in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        here, there = side * (start[axis] - bound), side * (end[axis] - bound)
        if here >= 0.0:
            kept.append(start)
        if here * there < 0.0:
            kept.append(start + (end - start) * (here / (here - there)))
    made = np.array(kept).reshape(-1, 2)
    same = np.hypot(*(made - np.roll(made, 1, axis=0)).T) < _SAME if len(made) else np.zeros(0, dtype=bool)
    return made[~same]
