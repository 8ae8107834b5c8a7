"""Walls, barricades and buildings: they stop or deflect fragments and count hits by face.

Lengths in m. The case's tables [[obstacle]] are made from the dataclasses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import TYPE_CHECKING, Annotated, Any, ClassVar

import numpy as np

from flight.arguments import Size, Thickness, real_array, require_number, require_numbers
from flight.errors import InputError
from flight.scene.ricochet import Ricochet
from fragfield_base.bounds import Bounds
from fragfield_base.inputs import Length, Offset

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    Face = tuple[NDArray[np.float64], NDArray[np.float64]]  # a point of it, its outward unit normal
    # height of the ground (m) at x and y, None where there is none
    Ground = Callable[[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64] | None]


FIRST_FACE, FACES, COLUMNS = 7, 6, 43  # as in flight.kernels.faces
DEPTH = 1.0  # m that obstacles reach below the lowest ground, so that nothing passes under them
SLACK = 1e-6  # m by which boxes are wider, and parts of a crest longer where they join
SPACING = 0.5  # m between the points at which a crest meets the ground below
CREST = 0.02  # of the height, by which a crest may lie off its height over the ground
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class _Standing:
    """What all obstacles have; they reach down to the ground everywhere."""

    name: str
    """A name of its own."""
    base: Length | None = None
    """z from which its height counts: its top is level; left out: the ground, of a building at its centre, of a wall or
    barricade below each point of its line: its crest follows the ground."""
    ricochet: Ricochet | str | None = None
    """Kind of surface, off which fragments ricochet at grazing angles; "none": they stop."""


@dataclass(frozen=True)
class _AlongLine(_Standing):
    start: Offset
    """x and y of one end of its centre line or crest."""
    end: Offset
    """x and y of the other end; left and right are as seen from start to end."""
    height: Size
    """Height of the wall or crest."""
    across: ClassVar[str]

    def __post_init__(self) -> None:
        _check(self, ("start", "end"), ("height", self.across))
        require_number(f"obstacle {self.name}", "slope", getattr(self, "slope", 0.0), "", low=0.0)
        if tuple(self.start) == tuple(self.end):
            raise InputError(f"obstacle {self.name}: start and end are both {self.start}; they must differ")

    @property
    def _slope(self) -> float:
        return float(getattr(self, "slope", 0.0))

    def crest(self, ground: Ground) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Positions along its line (n,), from 0 to 1, and heights z of its crest there (m), straight between them."""
        ends = np.array([0.0, 1.0])
        if self.base is not None:
            return ends, np.full(2, self.base + self.height)
        start, way = np.array(self.start), np.subtract(self.end, self.start)
        along = np.linspace(0.0, 1.0, 2 + math.ceil(float(np.hypot(*way)) / SPACING))
        found = ground(*(start[:, None] + way[:, None] * along))
        if found is None:
            raise InputError(f"obstacle {self.name}: there is no ground to stand on; give it a base (z, m)")
        top = np.asarray(found) + self.height
        kept = _straight_parts(along, top, CREST * self.height)
        return along[kept], top[kept]

    def sides(
        self, top: float | tuple[float, float], bottom: float, part: tuple[float, float] = (0.0, 1.0)
    ) -> tuple[list[Face], NDArray[np.float64]]:
        """Faces of a part of its line from `bottom` to `top` (z, m; at both ends), and corners of their hull (n, 3)."""
        start, way = np.array([*self.start, 0.0]), np.array([*np.subtract(self.end, self.start), 0.0])
        length = float(np.linalg.norm(way))
        centre, half = start + 0.5 * sum(part) * way, 0.5 * (part[1] - part[0]) * length
        half += SLACK if part != (0.0, 1.0) else 0.0  # so that no path slips in where two parts join
        return _prism(centre, way / length, half, 0.5 * getattr(self, self.across), self._slope, top, bottom)


@dataclass(frozen=True)
class Wall(_AlongLine):
    """An upright wall. Faces: left and right as seen from start to end, start, end, top."""

    thickness: Thickness = 0.2
    """Thickness."""
    name: str = field(default="wall", kw_only=True)
    faces: ClassVar[tuple[str, ...]] = ("left", "right", "start", "end", "top", "under")
    across: ClassVar[str] = "thickness"


@dataclass(frozen=True)
class Barricade(_AlongLine):
    """An earth barricade: a bank with sloped sides and upright ends. Faces as of `Wall`."""

    crest_width: Thickness = 1.0
    """Width of the crest."""
    slope: Annotated[float, Bounds(0.0, 1e3, "flatter than any bank")] = 2.0
    """How far the sides run out for each unit of height."""
    name: str = field(default="barricade", kw_only=True)
    faces: ClassVar[tuple[str, ...]] = ("left", "right", "start", "end", "crest", "under")
    across: ClassVar[str] = "crest_width"


@dataclass(frozen=True)
class Building(_Standing):
    """A box. Faces: front, whose normal points along the azimuth, back, left, right, roof."""

    position: Offset
    """x and y of the centre of its plan."""
    length: Size
    """Along `azimuth`."""
    width: Size
    """Across `azimuth`."""
    height: Size
    """Height."""
    azimuth: float = 0.0
    """Direction of its length (degrees), from +x counter-clockwise."""
    name: str = field(default="building", kw_only=True)
    faces: ClassVar[tuple[str, ...]] = ("left", "right", "back", "front", "roof", "under")

    def __post_init__(self) -> None:
        _check(self, ("position",), ("length", "width", "height"))
        require_number(f"obstacle {self.name}", "azimuth", self.azimuth, "degrees", finite=True)

    def crest(self, ground: Ground) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """As of `Wall`; level."""
        base = self.base
        if base is None:
            below = ground(*np.array(self.position, dtype=np.float64)[:, None])
            if below is None:
                raise InputError(f"obstacle {self.name}: there is no ground to stand on; give it a base (z, m)")
            base = float(below[0])
        return np.array([0.0, 1.0]), np.full(2, base + self.height)

    def sides(
        self, top: float | tuple[float, float], bottom: float, part: tuple[float, float] = (0.0, 1.0)
    ) -> tuple[list[Face], NDArray[np.float64]]:
        """As of `Wall`; of the whole."""
        del part
        turn = math.radians(self.azimuth)
        along = np.array([math.cos(turn), math.sin(turn), 0.0])
        centre = np.array([*self.position, 0.0])
        return _prism(centre, along, 0.5 * self.length, 0.5 * self.width, 0.0, top, bottom)


Obstacle = Wall | Barricade | Building


def pack_obstacles(obstacles: Sequence[Obstacle], lowest: float | None, ground: Ground) -> NDArray[np.float64]:
    """Rows (n, 43) for the kernels, one for each straight part of a crest; the number of the obstacle comes first.

    `lowest` is the lowest ground (z, m), None without ground. Raises InputError for an obstacle that has no ground to
    stand on, or does not stand out of it.
    """
    rows: list[NDArray[np.float64]] = []
    for index, obstacle in enumerate(obstacles):
        along, tops = obstacle.crest(ground)
        below = ground(*_centre(obstacle)[:, None])
        if below is not None and obstacle.base is not None and tops[0] <= below[0]:
            raise InputError(
                f"obstacle {obstacle.name}: its top at {tops[0]:g} m is not above the ground there, {below[0]:g} m; "
                "raise its base or leave it out"
            )
        bottom = float(tops.min()) - obstacle.height if lowest is None else min(tops.min() - obstacle.height, lowest)
        for part, top in zip(pairwise(along.tolist()), pairwise(tops.tolist()), strict=True):
            faces, corners = obstacle.sides(top, bottom - DEPTH, part)
            slack = SLACK * (1.0 + np.abs(corners).max())
            row = np.zeros(COLUMNS)
            row[0], row[1:7:2], row[2:7:2] = index, corners.min(axis=0) - slack, corners.max(axis=0) + slack
            row[FIRST_FACE:] = np.ravel(faces)
            rows.append(row)
    return np.array(rows).reshape(-1, COLUMNS)


def _centre(obstacle: Obstacle) -> NDArray[np.float64]:
    if isinstance(obstacle, Building):
        return np.array(obstacle.position, dtype=np.float64)
    return 0.5 * np.add(obstacle.start, obstacle.end)


def _straight_parts(along: NDArray[np.float64], height: NDArray[np.float64], tolerance: float) -> NDArray[np.int64]:
    """Points between which a line lies within a tolerance of all others (Douglas and Peucker 1973)."""
    kept, waiting = {0, len(along) - 1}, [(0, len(along) - 1)]
    while waiting:
        first, last = waiting.pop()
        inner = slice(first, last + 1)
        off = np.abs(height[inner] - np.interp(along[inner], along[[first, last]], height[[first, last]]))
        if off.max() > tolerance:
            between = first + int(np.argmax(off))
            kept.add(between)
            waiting += [(first, between), (between, last)]
    return np.array(sorted(kept))


def depth_in(rows: NDArray[np.float64], position: NDArray[np.float64]) -> NDArray[np.float64]:
    """How deep positions (n, 3) lie in each obstacle (m), (n, obstacles); below zero outside."""
    faces = rows[:, FIRST_FACE:].reshape(len(rows), FACES, 2, 3)
    way = position[:, None, None, :] - faces[None, :, :, 0]
    return np.asarray(-np.einsum("nofj,ofj->nof", way, faces[:, :, 1]).max(axis=2))


def count_by_face(obstacles: Sequence[Obstacle], hits: NDArray[Any], energy: float = 79.0) -> list[dict[str, Any]]:
    """Hits (OBSTACLE_HITS) on each obstacle by face, as in summary.json; hazardous from `energy` (J) on."""
    table = []
    for index, obstacle in enumerate(obstacles):
        mine = hits[hits["obstacle"] == index]
        normals = [normal for _, normal in obstacle.sides(1.0, 0.0)[0]]
        entry = {"name": obstacle.name, "kind": type(obstacle).__name__.lower(), **_tally(mine, energy)}
        entry["faces"] = [
            {
                "face": face,
                "azimuth_deg": None if abs(n[2]) == 1.0 else round(math.degrees(math.atan2(n[1], n[0])), 9) % 360.0,
                **_tally(mine[mine["face"] == number], energy),
            }
            for number, (face, n) in enumerate(zip(obstacle.faces, normals, strict=True))
            if face != "under" or (mine["face"] == number).any()  # reached where there is no ground alone
        ]
        table.append(entry)
    return table


def _tally(hits: NDArray[Any], energy: float) -> dict[str, Any]:
    stopped = hits[hits["stopped"] == 1]
    return {
        "hits": len(hits),
        "hazardous_hits": int((hits["energy"] >= energy).sum()),
        "stopped": len(stopped),
        "stopped_mass": float(stopped["mass"].sum()),
        "max_energy": float(hits["energy"].max(initial=0.0)),
        "max_speed": float(hits["speed"].max(initial=0.0)),
    }


def _check(obstacle: _AlongLine | Building, places: tuple[str, ...], lengths: tuple[str, ...]) -> None:
    owner = f"obstacle {obstacle.name}"
    for what in places:
        real_array(owner, what, getattr(obstacle, what), "m", (2,))
    require_numbers(owner, obstacle, dict.fromkeys(lengths, "m"), above=0.0)
    if obstacle.base is not None:
        require_number(owner, "base", obstacle.base, "m", finite=True)
    try:
        Ricochet.of(obstacle.ricochet)
    except InputError as error:
        raise InputError(f"{owner}: {error}") from None


def _prism(
    centre: NDArray[np.float64], along: NDArray[np.float64], half_length: float, half_width: float, slope: float,
    top: float | tuple[float, float], bottom: float,
) -> tuple[list[Face], NDArray[np.float64]]:  # fmt: skip
    """Faces left, right, start, end, top, under, of a body whose left and right run out by `slope` below its top."""
    left = np.array([-along[1], along[0], 0.0])
    first, last = np.broadcast_to(top, 2).tolist()
    crest = centre + 0.5 * (first + last) * UP
    over = UP - 0.5 * (last - first) / half_length * along  # across a crest that rises along its line
    faces = []
    for s in (1.0, -1.0):
        normal = s * left + slope * over
        faces.append((crest + s * half_width * left, normal / np.linalg.norm(normal)))
    faces += [(crest + s * half_length * along, s * along) for s in (-1.0, 1.0)]
    faces += [(crest, over / np.linalg.norm(over)), (centre + bottom * UP, -UP)]
    corners = [
        centre + s * half_length * along + t * width * left + z * UP
        for s, end in ((-1.0, first), (1.0, last)) for t in (-1.0, 1.0)
        for z, width in ((end, half_width), (bottom, half_width + slope * (end - bottom)))
    ]  # fmt: skip
    return faces, np.array(corners)
