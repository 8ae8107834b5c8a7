"""Places of the rounds in the stacks of storage: rows, triangles and pallets. Arrays in, arrays out.

A place is an offset (m) from where the pattern stands: its rounds lie evenly about x = 0 and y = 0, and its lowest
layer at z = 0.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fragfield.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

__all__ = ["across_horizontally", "lies", "pallet", "row", "stands", "triangle"]

UPRIGHT = 1e-6  # sine of the angle to the vertical, or to the horizontal, up to which a round stands, or lies


def row(count: int, pitch: float) -> NDArray[np.float64]:
    """Rounds side by side along x.

    Parameters
    ----------
    count : int
        Number of rounds.
    pitch : float
        From centre to centre (m).

    Returns
    -------
    numpy.ndarray, shape (count, 3)
        Offsets (m), x rising.

    Raises
    ------
    InputError
        Fewer than one round, or no pitch.
    """
    return pallet((count, 1, 1), (pitch, 0.0, 0.0))


def triangle(base: int, pitch: float, axis: Sequence[float]) -> NDArray[np.float64]:
    """Rounds in the grooves of each other, in rows of base, base - 1, ..., 1: each touches its neighbours alike.

    Rounds that stand form an equilateral triangle seen from above, the first row along x. Rounds that lie form a
    pyramidal pile, one row on the other, each in the grooves of the row below.

    Parameters
    ----------
    base : int
        Rounds in the first row; 2 gives three rounds, 3 six.
    pitch : float
        From centre to centre of rounds that touch (m).
    axis : sequence of float, shape (3,)
        Common axis of the rounds; vertical or horizontal.

    Returns
    -------
    numpy.ndarray, shape (base (base + 1) / 2, 3)
        Offsets (m), row by row.

    Raises
    ------
    InputError
        Fewer than one round, no pitch, or an axis that is neither vertical nor horizontal.
    """
    _check((base,), (pitch,))
    if stands(axis):
        along, up = np.array([1.0, 0.0, 0.0]), np.array([0.0, 1.0, 0.0])
    elif lies(axis):
        along, up = across_horizontally(axis), np.array([0.0, 0.0, 1.0])
    else:
        raise InputError(f"triangle: found the axis {list(axis)}; allowed: vertical or horizontal")
    # The centroid of the places lies a third of the pile's height above its first row.
    lowest = -(base - 1) / 3.0 if stands(axis) else 0.0
    places = [
        ((column - 0.5 * (base - level - 1)) * along + np.sqrt(0.75) * (lowest + level) * up) * pitch
        for level in range(base)
        for column in range(base - level)
    ]
    return np.array(places)


def pallet(counts: Sequence[int], pitches: Sequence[float]) -> NDArray[np.float64]:
    """Rounds in a rectangular pattern of columns, rows and layers.

    Parameters
    ----------
    counts : sequence of int, shape (3,)
        Number along x, along y and of layers.
    pitches : sequence of float, shape (3,)
        From centre to centre along x, y and z (m); of no concern where there is one only.

    Returns
    -------
    numpy.ndarray, shape (counts[0] counts[1] counts[2], 3)
        Offsets (m), x fastest, then y, then z.

    Raises
    ------
    InputError
        A count below one, or no pitch where there are several.
    """
    _check(counts, pitches)
    steps = np.stack(np.meshgrid(*(np.arange(count) for count in reversed(counts)), indexing="ij"), axis=-1)
    steps = steps.reshape(-1, 3)[:, ::-1] - 0.5 * (np.array(counts) - 1) * [1, 1, 0]
    places: NDArray[np.float64] = steps * np.where(np.array(counts) > 1, pitches, 0.0)
    return places


def stands(axis: Sequence[float]) -> bool:
    """Whether a round with this axis stands upright, on its base or its nose."""
    return float(np.hypot(axis[0], axis[1])) <= UPRIGHT * float(np.linalg.norm(axis))


def lies(axis: Sequence[float]) -> bool:
    """Whether a round with this axis lies level."""
    return abs(float(axis[2])) <= UPRIGHT * float(np.linalg.norm(axis))


def across_horizontally(axis: Sequence[float]) -> NDArray[np.float64]:
    """Return the level unit vector across a level axis, x for a round along y, on the side of +x, else of +y."""
    across = np.array([axis[1], -axis[0], 0.0]) / float(np.hypot(axis[0], axis[1]))
    if across[0] < -UPRIGHT or (abs(across[0]) <= UPRIGHT and across[1] < 0.0):
        across = -across
    return across + 0.0  # no negative zero


def _check(counts: Sequence[int], pitches: Sequence[float]) -> None:
    for count, pitch in zip(counts, pitches, strict=True):
        if count < 1:
            raise InputError(f"found {count} rounds along one side of a stack; allowed: at least 1")
        if count > 1 and not (np.isfinite(pitch) and pitch > 0.0):
            raise InputError(f"found a pitch of {pitch} m between rounds; allowed: greater than 0 m")
