"""Random deviation of each fragment's direction of flight from that of the metal that it is made of.

The burst is a continuum: the fragments of one position would all fly alike, those of a cylinder in a sheet less than a
degree thin. Real fragments part along shear lips, turn and push each other while they separate, and no panel or arena
test shows such a sheet. How large the deviation is, the panels of the 75 mm M48 show (`python -m validation
polar_zones`).
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from scipy.special import dawsn

from fragfield_base.elementary import cos, sin

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]


STIFFEST = 0.25
"""Fraction of the sum of mass times speed below which a direction's momentum cannot be restored by small turns."""
_CLOSED = 1e-13
_MOST_ROUNDS = 30


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
