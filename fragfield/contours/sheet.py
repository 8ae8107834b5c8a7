"""Curves of a drawing in its plane, and what was found and left out on the way."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Sequence

    from numpy.typing import NDArray

    Array = NDArray[np.float64]

__all__ = ["FINE", "Curve", "Sheet", "counted", "is_axis_name", "sampled"]

FINE = 0.05
"""Chords of a curve fall short of it by this share of the tolerance at most."""
_AXIS_NAME = re.compile(
    r"(^|[^a-z])(cl|axis|axes|achse|axe|eje|cent(er|re)[ _-]?lines?|mittellinie|rotachse)([^a-z]|$)"
)
_MOST_POINTS = 1 << 14  # of one curve


@dataclass(frozen=True, eq=False)
class Curve:
    """A smooth piece of a drawing: a line, an arc, a spline.

    Attributes
    ----------
    points : (n, 2) float64
        On the curve, from its start to its end (m), up is +y.
    layer : str
        Its layer in a DXF, its group in an SVG.
    """

    points: Array
    layer: str = ""

    @property
    def is_straight(self) -> bool:
        """Whether it is a line between two points."""
        return len(self.points) == 2

    @property
    def length(self) -> float:
        """Length (m)."""
        return float(np.hypot(*np.diff(self.points, axis=0).T).sum())


@dataclass(frozen=True, eq=False)
class Sheet:
    """What a drawing holds.

    Attributes
    ----------
    curves : list of Curve
        Of the contour.
    axes : list of Curve
        Lines that are drawn as centre lines.
    unit : float
        Length of one unit of the file (m).
    layers : dict
        Number of curves by layer.
    ignored : dict
        Number of entities that are no contour, by what they are.
    notes : list of str
        What was found, in words.
    up : float
        1 where y counts upwards in the file, -1 where it counts downwards.
    """

    curves: list[Curve]
    axes: list[Curve]
    unit: float
    layers: dict[str, int] = field(default_factory=dict)
    ignored: dict[str, int] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    up: float = 1.0

    def place(self, x: float, y: float) -> str:
        """A position (m) in the file's coordinates, for messages."""
        return f"({x / self.unit + 0.0:.6g}, {self.up * y / self.unit + 0.0:.6g})"

    @property
    def points(self) -> Array:
        """All points of the contour (n, 2)."""
        return np.concatenate([one.points for one in self.curves])


def is_axis_name(name: str) -> bool:
    """Whether a layer or a label is called as centre lines are."""
    return _AXIS_NAME.search(name.casefold()) is not None


def counted(numbers: dict[str, int]) -> str:
    """Numbers by name, in words."""
    return ", ".join(f"{number} {name}" for name, number in sorted(numbers.items()))


def sampled(at: Callable[[Array], Sequence[Sequence[float]] | Iterable[Sequence[float]]], deviation: float) -> Array:
    """Points of a curve over its parameter, so many that no chord is farther from it than `deviation`.

    Parameters
    ----------
    at : callable
        Positions for parameters (n,) from 0 to 1.
    deviation : float
        In the unit of the positions.
    """
    number = 8
    while True:
        fine = np.array([tuple(point)[:2] for point in at(np.linspace(0.0, 1.0, 2 * number + 1))], dtype=np.float64)
        points, middles = fine[::2], fine[1::2]
        chord = np.diff(points, axis=0)
        length = np.maximum(np.hypot(*chord.T), 1e-300)
        away = middles - points[:-1]
        off = np.abs(chord[:, 0] * away[:, 1] - chord[:, 1] * away[:, 0]) / length
        if off.max() <= deviation or number >= _MOST_POINTS:
            return points
        number *= 2
