"""Elements of one point: the material is asked with the mean motion, and its stress is that of the whole cell."""

from __future__ import annotations

from typing import TYPE_CHECKING

from burst_fenicsx.kernels.cells.rows import VOLUME
from burst_fenicsx.kernels.lanes import lane_function

if TYPE_CHECKING:
    import numpy as np

__all__ = ["MIN_VOLUME", "POINTS", "add_point", "end_points", "move_point"]

POINTS, MIN_VOLUME = 1, VOLUME


@lane_function
def move_point(point: int, step: float, scratch: np.ndarray) -> None:
    """Nothing."""


@lane_function
def add_point(point: int, scratch: np.ndarray) -> None:
    """Nothing."""


@lane_function
def end_points(scratch: np.ndarray) -> None:
    """Nothing."""
