"""Material points: the form in which a casing's state is handed to the break-up.

Points are made by a source: hexahedral cells (`transition.cells.cell_points`) are one, the rings of an axisymmetric
burst (`transition.cells.ring_points`) another.
"""

from __future__ import annotations

from dataclasses import dataclass, fields
from typing import TYPE_CHECKING, Protocol

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray


@dataclass(frozen=True, eq=False)
class MaterialPoints:
    """Points of a casing, each with its share of the mass. SI units.

    Attributes
    ----------
    position, velocity : (p, 3) float64
        Where they are (m) and how they move (m/s).
    reference : (p, 3) float64
        Where they were before the burst: two coordinates across the round's axis and the height along it (m).
    mass : (p,) float64
        Their masses (kg), above zero.
    round, segment : (p,) int32
        The round and the segment within it that they belong to.
    cell : (p,) int64
        The casing cell or ring they lie in, as an index of `Snapshot.casing`; -1 where the source has no cells.
    """

    position: NDArray[np.float64]
    velocity: NDArray[np.float64]
    reference: NDArray[np.float64]
    mass: NDArray[np.float64]
    round: NDArray[np.int32]
    segment: NDArray[np.int32]
    cell: NDArray[np.int64]

    def __len__(self) -> int:
        return int(self.mass.size)

    @classmethod
    def concatenate(cls, parts: Sequence[MaterialPoints]) -> MaterialPoints:
        """The points of several parts, one after the other."""
        return cls(*(np.concatenate([getattr(part, field.name) for part in parts]) for field in fields(cls)))


class PointArrays:
    """Arrays that a sampling kernel fills: values (p, 9), masses and cells (p,); `offset`: first point of each cell."""

    def __init__(self, number: NDArray[np.int64]) -> None:
        self.offset = np.concatenate([[0], np.cumsum(number)])
        total = int(self.offset[-1])
        self.values = np.empty((total, 9))
        self.mass, self.cell = np.empty(total), np.empty(total, dtype=np.int64)

    def of_segment(self, owner: int, segment: int) -> MaterialPoints:
        """The points, all of one segment of the round `owner`."""
        return MaterialPoints(
            position=self.values[:, :3],
            velocity=self.values[:, 3:6],
            reference=self.values[:, 6:],
            mass=self.mass,
            round=np.full(self.mass.size, owner, dtype=np.int32),
            segment=np.full(self.mass.size, segment, dtype=np.int32),
            cell=self.cell,
        )


class PointSource(Protocol):
    """Draws the material points of one segment; the same mass and momentum each time, at other positions."""

    def draw(self, generator: np.random.Generator) -> MaterialPoints:
        """Points of one realisation."""
        ...
