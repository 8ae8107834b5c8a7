"""Rigid motions of fragments: attitudes and images behind planes of symmetry; random deviation of directions.

Planes of symmetry stand at right angles to each other, as the burst stage finds them, so that reflections at them
commute: one image for one plane, three for two planes, seven for three.

The burst is a continuum: without a deviation the fragments of one position would all fly alike, those of a cylinder in
a sheet less than a degree thin. Real fragments part along shear lips, turn and push each other while they separate, and
no panel or arena test shows such a sheet. How large the deviation is, the panels of the 75 mm M48 show (`python -m
validation polar_zones`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import dawsn, ndtri

from fragfield_base.elementary import cos, sin
from transition.draws import Draws
from transition.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]
    Vector = tuple[float, float, float]


@dataclass(frozen=True, eq=False)
class Isometry:
    """A map x -> Q x + s with an orthogonal Q."""

    matrix: Array
    """(3, 3) float64: Q; its determinant is 1 for a rotation, -1 for an odd number of reflections."""
    shift: Array
    """(3,) float64: s, where the origin goes (m)."""

    def place(self, positions: Array) -> Array:
        """Positions (..., 3) in m after the motion."""
        return np.asarray(positions @ self.matrix.T + self.shift)

    def vector(self, vectors: Array) -> Array:
        """Velocities, momenta, or axes (..., 3) after the motion."""
        return np.asarray(vectors @ self.matrix.T)

    def after(self, first: Isometry | None) -> Isometry:
        """The motion `first`, then this one."""
        if first is None:
            return self
        return Isometry(self.matrix @ first.matrix, self.matrix @ first.shift + self.shift)

    def about(self, point: Array) -> Isometry:
        """The same rotation about `point` (m)."""
        return Isometry(self.matrix, point - self.matrix @ point)


def rotation(axis: Vector, point: Vector, angle: float) -> Isometry:
    """Rotation by `angle` (rad), right-handed about the direction `axis` through `point` (m)."""
    x, y, z = (component / math.hypot(*axis) for component in axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return Isometry(matrix, np.asarray(point) - matrix @ np.asarray(point))


@dataclass(frozen=True)
class Attitude:
    """How one realisation is turned and tilted."""

    turn: float | None = None
    """Angle about the round's own axis (rad); None for several rounds, which are not turned."""
    tilt: tuple[float, float] = (0.0, 0.0)
    """Rotation vector about the horizontal axes x and y (rad)."""

    @property
    def tilting(self) -> Isometry | None:
        """The tilt as a rotation about the origin; None without one."""
        return rotation((*self.tilt, 0.0), (0.0, 0.0, 0.0), math.hypot(*self.tilt)) if any(self.tilt) else None


def draw_attitude(seed: int, number: int, *, turned: bool, tilt: float) -> Attitude:
    """Draw the attitude of a realisation.

    `seed`, `number`: of the ensemble, and of the realisation in it. The turn does not depend on whether there is a
    tilt; `turned`: whether to turn by an angle that is uniform over the circle; `tilt`: standard deviation of the tilt
    about each of the two horizontal axes (rad).
    """
    around, *about = Draws(seed, number).uniform("attitude", 3).tolist()
    turn = 2.0 * math.pi * around if turned else None
    if not tilt > 0.0:
        return Attitude(turn)
    about_x, about_y = (tilt * ndtri(about)).tolist()
    return Attitude(turn, (about_x, about_y))


@dataclass(frozen=True)
class SymmetryPlane:
    """A plane of symmetry: a point on it (m), and its unit normal towards the rounds that were computed."""

    name: str
    point: Vector
    normal: Vector


@dataclass(frozen=True, eq=False)
class Image(Isometry):
    """One mirrored copy of everything computed."""

    planes: tuple[str, ...]
    """Names of the planes that it is mirrored at, one after the other."""

    def name_of(self, name: str) -> str:
        """Name of the image of the round `name`."""
        *first, last = self.planes
        planes = f"{', '.join(first)} and {last}" if first else last
        return f"{name} mirrored at {planes}"


_RIGHT = 1e-6  # cosine up to which two planes stand at right angles


def images(planes: Sequence[SymmetryPlane], source: str = "planes") -> tuple[Image, ...]:
    """All images that none to three planes of symmetry make, without the computed side itself.

    They are ordered by the number of reflections and then by the planes' names, whatever the order of the planes;
    `source`: where these come from, for messages. Raises InputError: planes that do not stand at right angles to each
    other.
    """
    planes = sorted(planes, key=lambda plane: plane.name)
    for first, second in combinations(planes, 2):
        cosine = float(np.dot(first.normal, second.normal))
        if abs(cosine) > _RIGHT:
            angle = math.degrees(math.acos(min(abs(cosine), 1.0)))
            raise InputError(
                f"{source}: the planes of symmetry {first.name!r} and {second.name!r} "
                f"{f'meet at {angle:.6g} degrees' if angle > 1e-4 else 'are parallel'}; allowed: planes at right angles"
            )
    made = []
    for chosen in (some for number in range(len(planes)) for some in combinations(planes, number + 1)):
        image = Image(np.eye(3), np.zeros(3), ())
        for plane in chosen:
            normal = np.asarray(plane.normal)
            matrix = np.eye(3) - 2.0 * np.outer(normal, normal)
            shift = matrix @ image.shift + 2.0 * float(normal @ plane.point) * normal
            image = Image(matrix @ image.matrix, shift, (*image.planes, plane.name))
        made.append(image)
    return tuple(made)


def deviated(directions: Array, angles: Array) -> Array:
    """Unit vectors (n, 3) turned by rotation vectors that are perpendicular to them.

    `directions` (n, 3): unit vectors; `angles` (n, 2): components of the rotation vector along two axes perpendicular
    to each direction and to each other (rad).
    """
    # The axis of a frame farthest from the direction is never parallel to it.
    helper = np.eye(3)[np.abs(directions).argmin(axis=1)]
    first = np.cross(directions, helper)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    second = np.cross(directions, first)
    turned_to = angles[:, :1] * second - angles[:, 1:] * first  # rotation vector x direction
    size = np.linalg.norm(angles, axis=1, keepdims=True)
    of_turn = sin(size) / np.maximum(size, np.finfo(float).tiny)  # of no turn, `turned_to` is zero
    return np.asarray(cos(size) * directions + of_turn * turned_to)


def mean_cosine(scatter: float) -> float:
    """Mean cosine of the deviation of a direction with this standard deviation about each of two axes (rad)."""
    return float(1.0 - math.sqrt(2.0) * scatter * dawsn(scatter / math.sqrt(2.0)))


STIFFEST = 0.25
"""Fraction of the sum of mass times speed below which a direction's momentum cannot be restored by small turns."""
_CLOSED = 1e-13
_MOST_ROUNDS = 30


def scattered(mass: Array, velocity: Array, angles: Array) -> Array:
    """Velocities (n, 3) of a segment's fragments after the random deviation of their directions, in m/s.

    Speeds stay. What the deviations together change of the segment's momentum is taken out by one small shift of all
    unit vectors, in the directions in which that is possible: fragments that all fly one way lose the fraction
    1 - cos of their deviation of the momentum along it. A segment of one piece keeps its direction.

    `mass` (n,), `velocity` (n, 3): of the fragments before (kg, m/s); `angles` (n, 2): see `deviated`: independent
    normal components with the standard deviation of the scatter (rad).
    """
    speed = np.linalg.norm(velocity, axis=1)
    moving = speed > 0.0
    result = velocity.copy()
    if not moving.any():
        return result
    weight, before = (mass * speed)[moving], velocity[moving] / speed[moving, None]
    after = deviated(before, angles[moving])
    scale, momentum = float(weight.sum()), weight @ before
    for _ in range(_MOST_ROUNDS):
        # A shift s of the unit vectors u changes the momentum by A s, A = sum of m v (1 - u u^T).
        stiffness = scale * np.eye(3) - (after.T * weight) @ after
        values, vectors = np.linalg.eigh(stiffness)
        missing = vectors.T @ (momentum - weight @ after)
        possible = values > STIFFEST * scale
        if np.abs(missing[possible]).max(initial=0.0) <= _CLOSED * scale:
            break
        shift = vectors[:, possible] @ (missing[possible] / values[possible])
        after = after + shift
        after /= np.linalg.norm(after, axis=1, keepdims=True)
    result[moving] = speed[moving, None] * after
    return result
