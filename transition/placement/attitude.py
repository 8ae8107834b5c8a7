"""The random attitude of a realisation: a turn about a single round's axis, and a tilt of everything together.

Nothing stands exactly plumb. The hazard distance is decided by the few fragments that leave within a degree of level;
for an exactly upright round their number depends on tenths of a degree of the velocity field, which neither a mesh nor
a drawing gives.

The size of the tilt decides more of a realisation's distance than its random break-up does. So realisations are tilted
in fours: their tilts lie in the four quarters of the distribution, in random order, and a quarter of a turn apart.
Each of them is distributed as a tilt drawn alone, and the standard error of a single M107's distance is half as large
(stratified and antithetic sampling, Owen 2013, chapters 8 and 10). The fours are independent of each other, the
realisations of one are not.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from transition.placement.isometry import Isometry, rotation

__all__ = ["TOGETHER", "Attitude", "draw_attitude"]

TOGETHER = 4
"""Realisations whose tilts are drawn together: numbers 0 to 3, 4 to 7, ..."""
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
    turn = float(2.0 * np.pi * own.random()) if turned else None
    if not tilt > 0.0:
        return Attitude(turn)
    about_x, about_y = _unit_tilt(seed, number)
    return Attitude(turn, (tilt * about_x, tilt * about_y))


def _unit_tilt(seed: int, number: int) -> tuple[float, float]:
    """Tilt of standard deviation 1 about each axis: a quarter of the quantiles for each realisation of a four."""
    position = number % TOGETHER
    four = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number - position, 0)))
    within, direction = four.random(2).tolist()
    quarter = int(four.permutation(TOGETHER)[position])
    quantile = (quarter + (within if quarter % 2 == 0 else 1.0 - within)) / TOGETHER
    size = math.sqrt(-2.0 * math.log1p(-quantile))  # of two normal components (Rayleigh)
    angle = 2.0 * math.pi * (direction + position / TOGETHER)
    return size * math.cos(angle), size * math.sin(angle)
