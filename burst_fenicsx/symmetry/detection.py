"""Planes that reflect rounds, their fillings, their initiation and all rigid planes onto themselves.

Every such plane contains the centroid of the rounds' positions. Candidates are the planes midway between two rounds,
those along a round's axis that contain or cross the line to another round, and, for a single round, those of its mesh,
of rigid planes beside it and of ignition points off its axis. What is kept is a set of planes at right angles to each
other: with k of them the whole is 2^k times the part.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from scipy.spatial import KDTree

from burst_fenicsx.meshing.placement import frame

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.problem import RigidPlane, Round

    Vector = NDArray[np.float64]

__all__ = ["Refusal", "find_planes", "reflected"]

_LENGTH = 1e-9  # m, up to which positions are the same
_ANGLE = 1e-9  # of unit vectors
_MOST_PLANES = 3


@dataclass(frozen=True)
class Refusal:
    """A plane that reflects the rounds' positions and axes but not all of what they are, and the reason."""

    normal: tuple[float, float, float]
    reason: str


@dataclass(frozen=True, eq=False)
class _Body:
    """A round as far as a reflection is concerned: `contents` are all that is independent of its place."""

    name: str
    position: Vector
    axis: Vector
    contents: Round
    points: Vector  # ignition points (n, 4): place in m, delay in s
    of_revolution: bool


def find_planes(rounds: Sequence[Round], planes: Sequence[RigidPlane]) -> tuple[list[Vector], Vector, list[Refusal]]:
    """Find the planes of symmetry of an arrangement.

    Parameters
    ----------
    rounds : the cased charges. planes : rigid planes, those of symmetry that the user has given among them.

    Returns
    -------
    Unit normals (3,) of planes at right angles to each other, as many as there are and none more than three; the point
    (3,) in m that all of them contain; and the planes that were refused though the positions allow them.
    """
    bodies = [_body(item) for item in rounds]
    centre = np.mean([body.position for body in bodies], axis=0)
    places = _Places(bodies)
    found: list[Vector] = []
    refused: list[Refusal] = []
    for normal in _candidates(bodies, centre, planes):
        images = places.images(centre, normal)
        if images is None:
            continue
        reason = _difference(bodies, images, centre, normal) or _plane_difference(planes, centre, normal)
        if not reason:
            found.append(normal)
        elif len(bodies) > 1:  # of a single round any plane along its axis would do, as far as the position goes
            refused.append(Refusal(_tuple(normal), reason))
    return _chosen(found, bodies, centre), centre, refused


def reflected(point: Vector, centre: Vector, normal: Vector) -> Vector:
    """Image of points (..., 3) in m behind the plane through `centre` (3,) with the unit `normal` (3,)."""
    return point - 2.0 * ((point - centre) @ normal)[..., None] * normal


def _body(item: Round) -> _Body:
    contents = replace(item, name="", position=(0.0, 0.0, 0.0), axis=(0.0, 0.0, 1.0), ignition=())
    if item.profile is not None:  # contours carry the round's place in the case file as their name
        profile = item.profile
        outer, cavity = replace(profile.outer, name=""), replace(profile.cavity, name="")
        contents = replace(contents, profile=replace(profile, name="", outer=outer, cavity=cavity))
    length = item.profile.length if item.profile is not None else 0.0
    e1, e2, along = frame(item.axis)
    points = [
        (*(item.position + (length - p.station) * along + p.offset[0] * e1 + p.offset[1] * e2), p.delay)
        for p in item.ignition
    ]
    axis = np.asarray(item.axis, dtype=float)
    return _Body(
        item.name,
        np.asarray(item.position, dtype=float),
        axis / np.linalg.norm(axis),
        contents,
        np.array(points, dtype=float).reshape(-1, 4),
        item.profile is not None and item.mesh_file is None,
    )


def _candidates(bodies: Sequence[_Body], centre: Vector, planes: Sequence[RigidPlane]) -> Iterator[Vector]:
    """Unit normals to try, each once; of opposite ones that along +x, +y or +z."""
    tried, count = np.empty((16, 3)), 0
    for vector in _directions(bodies, centre, planes):
        length = float(np.linalg.norm(vector))
        if length < _LENGTH:
            continue
        normal = vector / length
        normal[np.abs(normal) < 1e-14] = 0.0
        leading = normal[np.argmax(np.abs(normal) > 0.1)]
        normal = normal * np.sign(leading) + 0.0
        if (np.abs(tried[:count] @ normal) < 1.0 - _ANGLE).all():
            if count == len(tried):
                tried = np.concatenate([tried, np.empty_like(tried)])
            tried[count] = normal
            count += 1
            yield normal


def _directions(bodies: Sequence[_Body], centre: Vector, planes: Sequence[RigidPlane]) -> Iterator[Vector]:
    first = bodies[0]
    between = [body.position - first.position for body in bodies[1:]]
    yield from between
    # A reflection carries the first round to itself or to another one: of the others' lines none gives a new plane.
    yield from (np.cross(first.axis, line) for line in between)
    yield from (np.cross(first.axis, body.position - centre) for body in bodies)
    yield from frame(_tuple(first.axis))[:2]
    for plane in planes:
        normal = np.asarray(plane.normal, dtype=float)
        yield np.cross(first.axis, normal)
        yield normal
    for point in first.points:
        offset = point[:3] - first.position
        across = offset - (offset @ first.axis) * first.axis
        yield across
        yield np.cross(first.axis, across)


class _Places:
    """Positions and axes of all bodies, of which no two are the same."""

    def __init__(self, bodies: Sequence[_Body]) -> None:
        self._position = np.array([body.position for body in bodies])
        self._axis = np.array([body.axis for body in bodies])
        self._tree = KDTree(self._position)

    def images(self, centre: Vector, normal: Vector) -> NDArray[np.int64] | None:
        """Index of the body that stands where the reflection puts each; None where one of them has no such body."""
        place = reflected(self._position, centre, normal)
        distance, found = self._tree.query(place, p=np.inf, distance_upper_bound=_LENGTH)
        if not np.isfinite(distance).all():
            return None
        axis = self._axis - 2.0 * (self._axis @ normal)[:, None] * normal
        return np.asarray(found) if (np.abs(self._axis[found] - axis) < _ANGLE).all() else None


def _difference(bodies: Sequence[_Body], images: NDArray[np.int64], centre: Vector, normal: Vector) -> str:
    """What a reflection does not map on itself, in words; nothing where it maps all."""
    for body, index in zip(bodies, images.tolist(), strict=True):
        image = bodies[index]
        pair = f"round '{body.name}' and its image" + ("" if image is body else f", round '{image.name}',")
        if not (body.of_revolution and image.of_revolution):
            return f"round '{body.name}' is read from a mesh file, whose own symmetry is not known"
        if body.contents != image.contents:
            return f"{pair} differ in shape, filling, casing or initiation by shock"
        if not _same_points(body.points, image.points, centre, normal):
            return f"{pair} are not initiated alike"
    return ""


def _same_points(points: Vector, others: Vector, centre: Vector, normal: Vector) -> bool:
    if len(points) != len(others):
        return False
    left = list(range(len(others)))
    for point in points:
        place = reflected(point[:3], centre, normal)
        match = [
            k
            for k in left
            if np.abs(others[k, :3] - place).max() < _LENGTH and abs(others[k, 3] - point[3]) < 1e-15 + 1e-9 * point[3]
        ]
        if not match:
            return False
        left.remove(match[0])
    return True


def _plane_difference(planes: Sequence[RigidPlane], centre: Vector, normal: Vector) -> str:
    for plane in planes:
        along = np.asarray(plane.normal, dtype=float)
        along = along / np.linalg.norm(along)
        image = along - 2.0 * (along @ normal) * normal
        point = reflected(np.asarray(plane.point, dtype=float), centre, normal)
        if not any(_same_plane(plane, other, image, point) for other in planes):
            return f"it does not reflect the plane '{plane.name}' onto a plane alike"
    return ""


def _same_plane(plane: RigidPlane, other: RigidPlane, image: Vector, point: Vector) -> bool:
    along = np.asarray(other.normal, dtype=float)
    along = along / np.linalg.norm(along)
    same_kind = (plane.friction_angle, plane.symmetry) == (other.friction_angle, other.symmetry)
    return bool(
        same_kind
        and np.abs(along - image).max() < _ANGLE
        and abs((point - np.asarray(other.point, dtype=float)) @ along) < _LENGTH
    )


def _chosen(found: Sequence[Vector], bodies: Sequence[_Body], centre: Vector) -> list[Vector]:
    """The largest set of planes at right angles to each other; of equal ones that which cuts the fewest rounds."""
    for count in range(min(_MOST_PLANES, len(found)), 0, -1):
        sets = [
            chosen
            for chosen in combinations(found, count)
            if all(abs(float(a @ b)) < _ANGLE for a, b in combinations(chosen, 2))
        ]
        if sets:
            return list(min(sets, key=lambda normals: _cuts(normals, bodies, centre)))
    return []


def _cuts(normals: Iterable[Vector], bodies: Sequence[_Body], centre: Vector) -> int:
    return sum(abs(float((body.position - centre) @ normal)) < _LENGTH for normal in normals for body in bodies)


def _tuple(vector: Vector) -> tuple[float, float, float]:
    x, y, z = (float(value) for value in vector)
    return x, y, z
