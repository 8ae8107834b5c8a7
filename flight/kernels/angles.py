"""Angles of rows, one by one: numpy's vectorised arctangent rounds by a row's place in the array."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

from numba import njit

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["row_angles"]


def _row_angles(opposite: NDArray[np.float64], adjacent: NDArray[np.float64], result: NDArray[np.float64]) -> None:
    """Angle of (adjacent, opposite), (rows,), in degrees from -180 to 180."""
    for row in range(opposite.size):
        result[row] = math.degrees(math.atan2(opposite[row], adjacent[row]))


try:
    row_angles = njit(cache=True, nogil=True, error_model="numpy")(_row_angles)
except RuntimeError:  # numba finds no folder that it may write to
    row_angles = njit(nogil=True, error_model="numpy")(_row_angles)
