"""Lengths and angles of rows, one by one: numpy's vectorised functions round by a row's place in the array."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

from numba import njit

if TYPE_CHECKING:
    from collections.abc import Callable

    from numpy.typing import NDArray

__all__ = ["row_angles", "row_lengths"]


def _compiled(function: Callable[..., None]) -> Callable[..., Any]:
    try:
        return njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # numba finds no folder that it may write to
        return njit(nogil=True, error_model="numpy")(function)


@_compiled
def row_angles(opposite: NDArray[Any], adjacent: NDArray[Any], result: NDArray[Any]) -> None:
    """Angle of (adjacent, opposite), (rows,), in degrees from -180 to 180."""
    for row in range(opposite.size):
        result[row] = math.degrees(math.atan2(opposite[row], adjacent[row]))


@_compiled
def row_lengths(first: NDArray[Any], second: NDArray[Any], result: NDArray[Any]) -> None:
    """Length of (first, second), (rows,)."""
    for row in range(first.size):
        result[row] = math.hypot(first[row], second[row])
