"""Where a round stands: from stations and radii along its own axis to world coordinates."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import ArrayLike, NDArray


FACING = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 1.0, 0.0]])
"""Axes of the frame in which a meridian is drawn: r along x and z along y, seen along -z as ParaView first looks."""


def frame(axis: Sequence[float]) -> NDArray[np.float64]:
    """Return the right-handed frame of a round: rows e1, e2 and the unit axis (base to nose), shape (3, 3).

    It is the shortest rotation that carries +z to the axis, applied to x and y; for -z it is half a turn about x. So
    for the axis +z e1 = x and e2 = y.

    Raises
    ------
    InputError
        The axis is not three finite numbers, or has no length.
    """
    direction = np.asarray(axis, dtype=np.float64)
    if direction.shape != (3,) or not np.all(np.isfinite(direction)) or np.linalg.norm(direction) == 0.0:
        raise InputError(f"axis = {axis!r}; three finite numbers, not all zero, are expected")
    unit = direction / np.linalg.norm(direction)
    across = unit[0] ** 2 + unit[1] ** 2
    if across == 0.0:
        return np.diag([1.0, np.sign(unit[2]), np.sign(unit[2])])
    # 1 + cos, without cancellation where the axis points nearly down
    one_plus_cosine = 1.0 + unit[2] if unit[2] > 0.0 else across / (1.0 - unit[2])
    cross = np.array([-unit[1], unit[0], 0.0])  # z x unit
    spin = np.array([[0.0, -cross[2], cross[1]], [cross[2], 0.0, -cross[0]], [-cross[1], cross[0], 0.0]])
    rotation = np.eye(3) + spin + spin @ spin / one_plus_cosine
    transposed: NDArray[np.float64] = rotation.T.copy()
    return transposed


def place(local: ArrayLike, position: Sequence[float], axis: Sequence[float]) -> NDArray[np.float64]:
    """Carry points from the round's own frame (base centre at 0, nose at +z) to the world (m), shape (n, 3)."""
    points: NDArray[np.float64] = np.asarray(local) @ frame(axis) + np.asarray(position, dtype=np.float64)
    return points


def to_local(points: ArrayLike, position: Sequence[float], axis: Sequence[float]) -> NDArray[np.float64]:
    """Carry world points to the frame in which the base centre is 0 and the nose at +z (m), shape (n, 3)."""
    local: NDArray[np.float64] = (np.asarray(points) - np.asarray(position, dtype=np.float64)) @ frame(axis).T
    return local
