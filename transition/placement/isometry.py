"""Rigid motions: rotations and reflections, and the random roll and tilt of all fragments of a realisation."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import ndtri

from transition.draws import Draws

if TYPE_CHECKING:
    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class Isometry:
    """A map x -> Q x + s with an orthogonal Q."""

    matrix: NDArray[np.float64]
    """(3, 3) float64: Q; its determinant is 1 for a rotation, -1 for an odd number of reflections."""
    shift: NDArray[np.float64]
    """(3,) float64: s, where the origin goes (m)."""

    def place(self, positions: NDArray[np.float64]) -> NDArray[np.float64]:
        """Positions (..., 3) in m after the motion."""
        return np.asarray(positions @ self.matrix.T + self.shift)

    def vector(self, vectors: NDArray[np.float64]) -> NDArray[np.float64]:
        """Velocities, momenta, or axes (..., 3) after the motion."""
        return np.asarray(vectors @ self.matrix.T)

    def after(self, first: Isometry | None) -> Isometry:
        """The motion `first`, then this one."""
        if first is None:
            return self
        return Isometry(self.matrix @ first.matrix, self.matrix @ first.shift + self.shift)

    def about(self, point: NDArray[np.float64]) -> Isometry:
        """The same rotation about `point` (m)."""
        return Isometry(self.matrix, point - self.matrix @ point)


def rotation(axis: tuple[float, float, float], point: tuple[float, float, float], angle: float) -> Isometry:
    """Rotation by `angle` (rad), right-handed about the direction `axis` through `point` (m)."""
    x, y, z = (component / math.hypot(*axis) for component in axis)
    cross = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    matrix = np.eye(3) + math.sin(angle) * cross + (1.0 - math.cos(angle)) * (cross @ cross)
    return Isometry(matrix, np.asarray(point) - matrix @ np.asarray(point))


_NONE = (0.0, 0.0)


@dataclass(frozen=True)
class Attitude:
    """How one realisation is turned and tilted."""

    turn: float | None = None
    """Angle about the round's own axis (rad); None for several rounds, which are not turned."""
    tilt: tuple[float, float] = _NONE
    """(float, float): rotation vector about the horizontal axes x and y (rad)."""

    @property
    def tilting(self) -> Isometry | None:
        """The tilt as a rotation about the origin; None without one."""
        return None if self.tilt == _NONE else rotation((*self.tilt, 0.0), (0.0, 0.0, 0.0), math.hypot(*self.tilt))


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
