"""The random attitude of a realisation: a turn about a single round's axis, and a lean of everything together."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from transition.placement.isometry import Isometry, rotation

__all__ = ["Attitude", "draw_attitude"]

_NONE = (0.0, 0.0)


@dataclass(frozen=True)
class Attitude:
    """How one realisation is turned and tilted.

    Attributes
    ----------
    turn : float or None
        Angle about the round's own axis (rad); None for several rounds, which are not turned.
    tilt : (float, float)
        Rotation vector about the horizontal axes x and y (rad).
    """

    turn: float | None = None
    tilt: tuple[float, float] = _NONE

    @property
    def tilting(self) -> Isometry | None:
        """The tilt as a rotation about the origin; None without one."""
        return None if self.tilt == _NONE else rotation((*self.tilt, 0.0), (0.0, 0.0, 0.0), math.hypot(*self.tilt))


def draw_attitude(seed: int, number: int, *, turned: bool, tilt: float) -> Attitude:
    """Draw the attitude of a realisation.

    Parameters
    ----------
    seed, number : int
        Of the ensemble, and of the realisation in it. The turn does not depend on whether there is a tilt.
    turned : bool
        Whether to turn by an angle that is uniform over the circle.
    tilt : float
        Standard deviation of the tilt about each of the two horizontal axes (rad).
    """
    own = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
    around = float(2.0 * np.pi * own.random())
    turn = around if turned else None
    if not tilt > 0.0:
        return Attitude(turn)
    about_x, about_y = (tilt * own.standard_normal(2)).tolist()
    return Attitude(turn, (about_x, about_y))
