"""A place of a map: its name, its line or outline in longitude and latitude, and what is known of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from fragfield.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["MOST_BYTES", "Feature", "Shape", "positions"]

Shape = Literal["Point", "LineString", "Polygon"]
MOST_BYTES = 1 << 26
"""Of a file that is read."""


@dataclass(frozen=True, eq=False)
class Feature:
    """One point, line or polygon.

    Attributes
    ----------
    name : str
        Empty where it has none.
    shape : str
        "Point", "LineString" or "Polygon".
    rings : tuple of (n, 2) float64
        Longitudes and latitudes (degrees); of a polygon its outline, not closed, and then its holes.
    properties : dict
        By name.
    folders : tuple of str
        Those of a KML that it lies in, the innermost last.
    where : str
        For messages: 'feature 3 ("school")'.
    """

    name: str
    shape: Shape
    rings: tuple[Array, ...]
    properties: dict[str, Any] = field(default_factory=dict)
    folders: tuple[str, ...] = ()
    where: str = ""


def positions(values: object, shape: Shape, where: str) -> Array:
    """Longitudes and latitudes (n, 2) of a list of positions, each of two or three numbers.

    The last point of a closed ring, and points that follow themselves, are left out.

    Raises
    ------
    InputError
        Not such a list, or too few points.
    """
    try:
        found = np.array([[float(one[0]), float(one[1])] for one in values], dtype=np.float64)  # type: ignore[attr-defined]
    except (TypeError, ValueError, IndexError, KeyError):
        raise InputError(
            f"{where}: found positions that are no lists of numbers; allowed: longitude, latitude"
        ) from None
    if not np.isfinite(found).all():
        raise InputError(f"{where}: found a position that is not finite; allowed: longitude, latitude")
    if len(found) > 1:
        found = found[np.concatenate([[True], (np.diff(found, axis=0) != 0.0).any(axis=1)])]
    if shape == "Polygon" and len(found) > 1 and (found[0] == found[-1]).all():
        found = found[:-1]
    least = {"Point": 1, "LineString": 2, "Polygon": 3}[shape]
    if len(found) < least:
        raise InputError(f"{where}: found a {shape} of {len(found)} different positions; allowed: {least} or more")
    return found
