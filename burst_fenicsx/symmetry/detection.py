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
    from collections.abc import Iterator, Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.problem import Mirror, RigidPlane, Round

    Vector = NDArray[np.float64]


SAME_LENGTH = 1e-9
"""Distance (m) up to which positions are the same."""
_ANGLE = 1e-9  # of unit vectors
_MOST_PLANES = 3


@dataclass(frozen=True)
class Refusal:
    """A plane that reflects the rounds' positions and axes but not all of what they are, and the reason."""

    normal: tuple[float, float, float]
    reason: str


@dataclass(frozen=True, eq=False)
class _Body:
    """A round as far as a reflection is concerned: `contents` are all that is independent of its position."""

    name: str
    position: Vector
    axis: Vector
    contents: Round
    points: Vector  # ignition points (n, 4): position in m, delay in s
    of_revolution: bool


def find_planes(
    rounds: Sequence[Round], planes: Sequence[RigidPlane | Mirror]
) -> tuple[list[Vector], Vector, list[Refusal]]:
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
    position, axis = np.array([body.position for body in bodies]), np.array([body.axis for body in bodies])
    centre, tree = np.mean(position, axis=0), KDTree(position)
    found: list[Vector] = []
    refused: list[Refusal] = []
    for normal in _candidates(bodies, centre, planes):
        # The body that stands where the reflection puts each one.
        image = _reflected(position, normal, centre)
        distance, images = tree.query(image, p=np.inf, distance_upper_bound=SAME_LENGTH)
        if not np.isfinite(distance).all() or np.abs(axis[images] - _reflected(axis, normal)).max() > _ANGLE:
            continue
        reason = _difference(bodies, images, centre, normal) or _plane_difference(planes, centre, normal)
        if not reason:
            found.append(normal)
        elif len(bodies) > 1:  # of a single round any plane along its axis would do, as far as the position goes
            refused.append(Refusal(triple(normal), reason))
    return _chosen(found, position - centre), centre, refused


def triple(vector: Vector) -> tuple[float, float, float]:
    """The components of a vector (3,) as plain numbers."""
    x, y, z = (float(value) for value in vector)
    return x, y, z


def _reflected(points: Vector, normal: Vector, centre: Vector | float = 0.0) -> Vector:
    """Images of points (..., 3) behind the plane through `centre` with the unit `normal` (3,); of vectors without."""
    return points - 2.0 * ((points - centre) @ normal)[..., None] * normal


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


def _candidates(bodies: Sequence[_Body], centre: Vector, planes: Sequence[RigidPlane | Mirror]) -> Iterator[Vector]:
    """Unit normals to try, each once; of opposite ones that along +x, +y or +z."""
    tried: list[Vector] = []
    for vector in _directions(bodies, centre, planes):
        length = float(np.linalg.norm(vector))
        if length < SAME_LENGTH:
            continue
        normal = vector / length
        normal[np.abs(normal) < 1e-14] = 0.0
        leading = normal[np.argmax(np.abs(normal) > 0.1)]
        normal = normal * np.sign(leading) + 0.0
        if not tried or (np.abs(np.array(tried) @ normal) < 1.0 - _ANGLE).all():
            tried.append(normal)
            yield normal


def _directions(bodies: Sequence[_Body], centre: Vector, planes: Sequence[RigidPlane | Mirror]) -> Iterator[Vector]:
    first = bodies[0]
    between = [body.position - first.position for body in bodies[1:]]
    yield from between
    # A reflection carries the first round to itself or to another one: of the others' lines none gives a new plane.
    yield from (np.cross(first.axis, line) for line in between)
    yield from (np.cross(first.axis, body.position - centre) for body in bodies)
    yield from frame(triple(first.axis))[:2]
    for plane in planes:
        normal = np.asarray(plane.normal, dtype=float)
        yield np.cross(first.axis, normal)
        yield normal
    for point in first.points:
        offset = point[:3] - first.position
        across = offset - (offset @ first.axis) * first.axis
        yield across
        yield np.cross(first.axis, across)


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
    """Whether the ignition points `others` (n, 4) are the images of `points`, each of one of them."""
    if len(points) != len(others):
        return False
    apart = np.abs(others[None, :, :3] - _reflected(points[:, :3], normal, centre)[:, None]).max(axis=2)
    later = np.abs(others[None, :, 3] - points[:, None, 3])
    same = (apart < SAME_LENGTH) & (later < 1e-15 + 1e-9 * points[:, None, 3])
    return bool(same.any(axis=0).all() and same.any(axis=1).all())


def _plane_difference(planes: Sequence[RigidPlane | Mirror], centre: Vector, normal: Vector) -> str:
    for plane in planes:
        image = _reflected(_unit(plane.normal), normal)
        point = _reflected(np.asarray(plane.point, dtype=float), normal, centre)
        if not any(_same_plane(plane, other, image, point) for other in planes):
            return f"it does not reflect the plane '{plane.name}' onto a plane alike"
    return ""


def _same_plane(plane: RigidPlane | Mirror, other: RigidPlane | Mirror, image: Vector, point: Vector) -> bool:
    """Whether the image of a plane, with the unit normal `image` through `point`, is the other one and of its kind."""
    if type(plane) is not type(other) or plane.friction_angle != other.friction_angle:
        return False
    along = _unit(other.normal)
    apart = abs(float((point - np.asarray(other.point, dtype=float)) @ along))
    return bool(np.abs(along - image).max() < _ANGLE) and apart < SAME_LENGTH


def _unit(vector: Sequence[float]) -> Vector:
    given = np.asarray(vector, dtype=float)
    unit: Vector = given / np.linalg.norm(given)
    return unit


def _chosen(found: Sequence[Vector], places: Vector) -> list[Vector]:
    """The largest set of planes at right angles to each other; of equal ones that which cuts the fewest rounds.

    `places` (rounds, 3) m are those of the rounds from a point in all planes.
    """
    for count in range(min(_MOST_PLANES, len(found)), 0, -1):
        sets = [
            chosen
            for chosen in combinations(found, count)
            if all(abs(float(a @ b)) < _ANGLE for a, b in combinations(chosen, 2))
        ]
        if sets:
            return list(min(sets, key=lambda normals: int((np.abs(places @ np.array(normals).T) < SAME_LENGTH).sum())))
    return []
