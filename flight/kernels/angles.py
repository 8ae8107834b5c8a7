"""Lengths and angles of rows, one by one: numpy rounds vectorised functions differently by a row's index."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from flight.kernels.compiling import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["row_angles", "row_lengths"]


@kernel
def row_angles(opposite: NDArray[Any], adjacent: NDArray[Any], result: NDArray[Any]) -> None:
    """Angle of (adjacent, opposite), (rows,), in degrees from -180 to 180."""
    for row in range(opposite.size):
        result[row] = math.degrees(math.atan2(opposite[row], adjacent[row]))


@kernel
def row_lengths(first: NDArray[Any], second: NDArray[Any], result: NDArray[Any]) -> None:
    """Length of (first, second), (rows,)."""
    for row in range(first.size):
        result[row] = math.hypot(first[row], second[row])
