"""The random attitude of a realisation: a turn about a single round's axis, and a tilt of everything together.

Nothing stands exactly plumb. The hazard distance is decided by the few fragments that leave within a degree of level;
for an exactly upright round their number depends on tenths of a degree of the velocity field, which neither a mesh nor
a drawing gives.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from transition.isometry import Isometry, rotation

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


def draw_attitude(stream: np.random.SeedSequence, *, turned: bool, tilt: float) -> Attitude:
    """Draw the attitude of a realisation.

    Parameters
    ----------
    stream : SeedSequence
        Of the realisation; the turn does not depend on whether there is a tilt.
    turned : bool
        Whether to turn by an angle that is uniform over the circle.
    tilt : float
        Standard deviation of the tilt about each of the two horizontal axes (rad).
    """
    generator = np.random.default_rng(stream)
    angle = float(2.0 * np.pi * generator.random())
    about_x, about_y = (generator.normal(size=2) * tilt).tolist() if tilt > 0.0 else _NONE
    return Attitude(angle if turned else None, (about_x, about_y))
