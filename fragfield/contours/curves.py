"""Curves of a drawing in its plane."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from fragfield.errors import InputError, nearest

if TYPE_CHECKING:
    from shapely import LineString

Array = NDArray[np.float64]


FINE = 0.05
"""Chords of a curve fall short of it by this share of the tolerance at most."""
_AXIS_NAME = re.compile(
    r"(^|[^a-z])(cl|axis|axes|achse|axe|eje|cent(er|re)[ _-]?lines?|mittellinie|rotachse)([^a-z]|$)"
)
_MOST_POINTS = 1 << 14  # of one curve


@dataclass(frozen=True, eq=False)
class Curve:
    """A smooth piece of a drawing: a line, an arc, a spline."""

    points: Array
    """(n, 2) float64: on the curve, from its start to its end (m), up is +y."""
    layer: str = ""
    """Its layer."""

    @property
    def is_straight(self) -> bool:
        """Whether it is a line between two points."""
        return len(self.points) == 2

    @cached_property
    def line(self) -> LineString:
        """Its points as shapely has them."""
        import shapely

        return shapely.LineString(self.points)

    @property
    def length(self) -> float:
        """Length (m)."""
        return float(self.line.length)


@dataclass(frozen=True, eq=False)
class Sheet:
    """What a drawing holds."""

    curves: list[Curve]
    """Of the contour."""
    axes: list[Curve]
    """Lines that are drawn as centre lines."""
    unit: float
    """Length of one unit of the file (m)."""
    layers: dict[str, int] = field(default_factory=dict)
    """Number of curves by layer."""
    ignored: dict[str, int] = field(default_factory=dict)
    """Number of entities that are no contour, by what they are."""
    notes: list[str] = field(default_factory=list)
    """What was found, in words."""

    def place(self, x: float, y: float) -> str:
        """A position (m) in the file's coordinates, for messages."""
        return f"({x / self.unit + 0.0:.6g}, {y / self.unit + 0.0:.6g})"

    @property
    def points(self) -> Array:
        """All points of the contour (n, 2)."""
        return np.concatenate([one.points for one in self.curves])


def is_axis_name(name: str) -> bool:
    """Whether a layer or a label is called as centre lines are."""
    return _AXIS_NAME.search(name.casefold()) is not None


def folded(path: object, names: Iterable[str], known: set[str]) -> set[str]:
    """Names of layers in lower case; raises InputError for one that a drawing does not have."""
    for name in names:
        if name.casefold() not in {one.casefold() for one in known}:
            allowed = ", ".join(sorted(known)) or "none, without names"
            raise InputError(f'{path}: layers: found "{name}"{nearest(name, known)}; allowed: {allowed}')
    return {name.casefold() for name in names}


def counted(numbers: dict[str, int]) -> str:
    """Numbers by name, in words."""
    return ", ".join(f"{number} {name}" for name, number in sorted(numbers.items()))


def sampled(at: Callable[[Array], Sequence[Sequence[float]] | Iterable[Sequence[float]]], deviation: float) -> Array:
    """Points of a curve over its parameter, so many that no chord is farther from it than `deviation`.

    `at`: positions for parameters (n,) from 0 to 1; `deviation`: in the unit of the positions.
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
