"""Walls, barricades and buildings: they stop or deflect fragments and count hits by face.

Lengths in m. The case's tables [[obstacle]] are made from the dataclasses.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
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


FIRST_FACE, FACES, COLUMNS = 7, 6, 43  # as in flight.kernels.obstacles
DEPTH = 1.0  # m that obstacles reach below the lowest ground, so that nothing passes under them
SLACK = 1e-6  # m by which boxes are wider
UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True, kw_only=True)
class _Standing:
    """What all obstacles have; they reach down to the ground everywhere."""

    name: str
    """A name of its own."""
    base: Length | None = None
    """z from which its height counts; left out: the ground at its centre."""
    ricochet: Ricochet | str | None = None
    """Kind of surface, off which fragments ricochet at grazing angles; "none": they stop."""


@dataclass(frozen=True)
class _AlongLine(_Standing):
    """An obstacle along a line on the ground."""

    start: Offset
    """x and y of one end of its centre line or crest."""
    end: Offset
    """x and y of the other end; left and right are as seen from start to end."""
    height: Size
    """Height of the wall or crest."""

    @property
    def plan_centre(self) -> tuple[float, float]:
        """Centre of its plan (x, y)."""
        return 0.5 * (self.start[0] + self.end[0]), 0.5 * (self.start[1] + self.end[1])


@dataclass(frozen=True)
class Wall(_AlongLine):
    """An upright wall. Faces: left and right as seen from start to end, start, end, top."""

    thickness: Thickness = 0.2
    """Thickness."""
    name: str = field(default="wall", kw_only=True)
    faces: ClassVar[tuple[str, ...]] = ("left", "right", "start", "end", "top", "under")

    def __post_init__(self) -> None:
        """Refuse what is not a wall."""
        _check(self, ("start", "end"), ("height", "thickness"))
        _direction(self)

    def sides(self, top: float, bottom: float) -> tuple[list[Face], NDArray[np.float64]]:
        """Faces from `bottom` to `top` (z, m), and the corners of their hull (n, 3)."""
        centre, along, half = _direction(self)
        return _prism(centre, along, half, 0.5 * self.thickness, 0.0, top, bottom)


@dataclass(frozen=True)
class Barricade(_AlongLine):
    """An earth barricade: a bank with sloped sides and upright ends. Faces as of `Wall`."""

    crest_width: Thickness = 1.0
    """Width of the crest."""
    slope: Annotated[float, Bounds(0.0, 1e3, "flatter than any bank")] = 2.0
    """How far the sides run out for each unit of height."""
    name: str = field(default="barricade", kw_only=True)
    faces: ClassVar[tuple[str, ...]] = ("left", "right", "start", "end", "crest", "under")

    def __post_init__(self) -> None:
        """Refuse what is not a bank."""
        _check(self, ("start", "end"), ("height", "crest_width"))
        require_number(f"obstacle {self.name}", "slope", self.slope, "", low=0.0)
        _direction(self)

    def sides(self, top: float, bottom: float) -> tuple[list[Face], NDArray[np.float64]]:
        """As of `Wall`."""
        centre, along, half = _direction(self)
        return _prism(centre, along, half, 0.5 * self.crest_width, self.slope, top, bottom)


@dataclass(frozen=True)
class Building(_Standing):
    """A box. Faces: front, whose normal points along the azimuth, back, left, right, roof."""

    centre: Offset
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
        """Refuse what is not a box."""
        _check(self, ("centre",), ("length", "width", "height"))
        require_number(f"obstacle {self.name}", "azimuth", self.azimuth, "degrees", finite=True)

    @property
    def plan_centre(self) -> tuple[float, float]:
        """Centre of its plan (x, y)."""
        return float(self.centre[0]), float(self.centre[1])

    def sides(self, top: float, bottom: float) -> tuple[list[Face], NDArray[np.float64]]:
        """As of `Wall`."""
        turn = math.radians(self.azimuth)
        along = np.array([math.cos(turn), math.sin(turn), 0.0])
        centre = np.array([*self.centre, 0.0])
        return _prism(centre, along, 0.5 * self.length, 0.5 * self.width, 0.0, top, bottom)


Obstacle = Wall | Barricade | Building


def pack_obstacles(
    obstacles: Sequence[Obstacle], lowest: float | None, ground: Callable[[float, float], float | None]
) -> NDArray[np.float64]:
    """Rows (n, 43) for the kernels.

    `lowest` is the lowest ground (z, m), None without ground, and `ground` gives its height at (x, y). Raises
    InputError for an obstacle that has no ground to stand on, or does not stand out of it.
    """
    rows = np.zeros((len(obstacles), COLUMNS))
    for row, obstacle in zip(rows, obstacles, strict=True):
        if not isinstance(obstacle, Wall | Barricade | Building):
            raise InputError(
                f"obstacle {obstacle!r}: a {type(obstacle).__name__}, allowed: flight.Wall, Barricade or Building"
            )
        x, y = obstacle.plan_centre
        below = ground(x, y)
        base = below if obstacle.base is None else obstacle.base
        if base is None:
            raise InputError(f"obstacle {obstacle.name}: there is no ground to stand on; give it a base (z, m)")
        top = base + obstacle.height
        if below is not None and top <= below:
            raise InputError(
                f"obstacle {obstacle.name}: its top at {top:g} m is not above the ground there, {below:g} m; "
                "raise its base or leave it out"
            )
        bottom = base if lowest is None else min(base, lowest) - DEPTH
        faces, corners = obstacle.sides(top, bottom)
        slack = SLACK * (1.0 + np.abs(corners).max())
        row[1:7:2], row[2:7:2] = corners.min(axis=0) - slack, corners.max(axis=0) + slack
        for number, (point, normal) in enumerate(faces):
            row[FIRST_FACE + 6 * number : FIRST_FACE + 6 * number + 6] = [*point, *normal]
    return rows


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


def _check(obstacle: Obstacle, places: tuple[str, ...], lengths: tuple[str, ...]) -> None:
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


def _direction(obstacle: Wall | Barricade) -> tuple[NDArray[np.float64], NDArray[np.float64], float]:
    """Centre, unit vector from start to end, half the length."""
    way = np.array([obstacle.end[0] - obstacle.start[0], obstacle.end[1] - obstacle.start[1], 0.0])
    length = float(np.linalg.norm(way))
    if not length > 0.0:
        raise InputError(f"obstacle {obstacle.name}: start and end are both {obstacle.start}; they must differ")
    return np.array([*obstacle.plan_centre, 0.0]), way / length, 0.5 * length


def _prism(
    centre: NDArray[np.float64], along: NDArray[np.float64], half_length: float, half_width: float, slope: float,
    top: float, bottom: float,
) -> tuple[list[Face], NDArray[np.float64]]:  # fmt: skip
    """Faces left, right, start, end, top, under, of a body whose left and right run out by `slope` below its top."""
    left = np.array([-along[1], along[0], 0.0])
    crest = centre + top * UP
    faces = [(crest + s * half_width * left, (s * left + slope * UP) / math.hypot(1.0, slope)) for s in (1.0, -1.0)]
    faces += [(crest + s * half_length * along, s * along) for s in (-1.0, 1.0)]
    faces += [(crest, UP), (centre + bottom * UP, -UP)]
    foot = half_width + slope * (top - bottom)
    corners = [
        centre + s * half_length * along + t * width * left + z * UP
        for s in (-1.0, 1.0) for t in (-1.0, 1.0) for z, width in ((top, half_width), (bottom, foot))
    ]  # fmt: skip
    return faces, np.array(corners)
