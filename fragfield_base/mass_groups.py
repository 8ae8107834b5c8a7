"""Fragments counted by groups of mass: the group whose pieces weigh what none of its pieces can."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

__all__ = ["group_outside"]

_ROUNDING = 1e-3  # of a mass as a test's table prints it


def group_outside(number: ArrayLike, mass: ArrayLike, low: ArrayLike, high: ArrayLike) -> int | None:
    """First group whose pieces together are lighter or heavier than its ends allow; None where all fit.

    All (k,): pieces of each group, what they weigh together (kg), and its ends (kg), of which `high` may be infinite.
    """
    number, mass, low, high = (np.asarray(one, dtype=np.float64) for one in (number, mass, low, high))
    most = np.where(number > 0.0, np.where(number > 0.0, number, 1.0) * high, 0.0)
    bad = (mass < (1.0 - _ROUNDING) * number * low) | (mass > (1.0 + _ROUNDING) * most)
    return int(np.argmax(bad)) if bad.any() else None
