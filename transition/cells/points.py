"""Material points: the form in which a casing's state is handed to the break-up, made by hexahedra or by rings.

Hexahedra. A cell's mass is spread evenly over its reference coordinates, as the lumped masses of the burst stage have
it. The points of a cell share its mass equally. They come in pairs of random places and their reflections through the
cell's centre, and what this leaves of the bilinear modes is taken from all points of a cell alike
(`kernels.sampling`). So their mean position and mean velocity are those of the cell's nodes to round-off, whatever
the places: mass, momentum and centre of mass agree with the finite-element field cell by cell.

Rings. The state goes straight to points around the axis; no hexahedra stand between. A ring's mass is distributed as
the burst stage lumps it, by r dA over its reference quadrilateral. Its points share the mass equally and are placed
by that measure (`kernels.sampling`); every block of four begins at an azimuth of its own, so that the fragments show
neither sectors nor columns of cells. Mass, axial momentum, centre of mass and mean radial speed are those of every
ring to round-off. Opposite points come in pairs, so that transverse momentum is zero.

The number of points follows the law of the segment: the lightest fragment that matters spans `POINTS_PER_FRAGMENT`.
That is the fragment above which fragments carry the share `MASS_THAT_MATTERS` of the mass. With Mott's law in two
dimensions it weighs 0.16 mean masses: about 1.8 g for a 155 mm shell, whose hazard distance is set by fragments of 10
g and more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, fields
from functools import cache, cached_property
from typing import TYPE_CHECKING, Protocol

import numpy as np
from scipy.optimize import brentq

from transition.cells.interpolation import modes
from transition.cells.meridian import mass_density, node_shares
from transition.kernels.sampling import sample_cells, sample_rings
from transition.law.mott import MottLaw, MottPart

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from transition.cells.meridian import HalfPlane
    from transition.law.mott import Dimension


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


POINTS_PER_FRAGMENT = 8
MASS_THAT_MATTERS = 0.98
MOST_POINTS = 1_000_000  # of a casing: 100 MB
_EIGHT_UP_TO = 400_000  # points of a casing up to which every cell has eight at least; otherwise a pair


def lightest_that_matters(law: MottLaw) -> float:
    """Mass (kg) of the fragment above which fragments hold `MASS_THAT_MATTERS` of the mass of `law`."""
    return law.mean * _lightest(tuple((part.dimension, part.weight) for part in law.parts))


@cache
def _lightest(parts: tuple[tuple[Dimension, float], ...]) -> float:
    """That of a law of the mean mass one, with these dimensions and weights of its parts."""
    law = MottLaw(tuple(MottPart(dimension, 1.0 / math.factorial(dimension), weight) for dimension, weight in parts))

    def excess(logarithm: float) -> float:
        return float(law.mass_fraction_above(np.exp(logarithm))) - MASS_THAT_MATTERS

    return float(np.exp(brentq(excess, -20.0, 3.0)))


def numbers(
    cell_mass: Sequence[NDArray[np.float64]],
    lightest: Sequence[float],
    most: int = MOST_POINTS,
    *,
    together: int = 2,
) -> list[NDArray[np.int64]]:
    """Points of every cell of several segments, a multiple of `together`.

    `cell_mass` (m,): masses of the cells (kg), by segment; `lightest`: the lightest fragment that matters (kg), by
    segment: it spans `POINTS_PER_FRAGMENT` points or more; `most`: where all segments together would need more points,
    every segment has fewer in proportion, down to `together` a cell; `together`: how many points a source places at a
    time: 2 or 4.
    """
    cells = sum(mass.size for mass in cell_mass)
    fewest = 8 if 8 * cells <= _EIGHT_UP_TO else together
    coarser = 1.0
    while True:
        needed = [POINTS_PER_FRAGMENT * mass / (m * coarser) for mass, m in zip(cell_mass, lightest, strict=True)]
        found = [np.maximum(together * np.ceil(number / together).astype(np.int64), fewest) for number in needed]
        total = sum(int(number.sum()) for number in found)
        if total <= most or total == fewest * cells:
            return found
        coarser *= max(1.05, 0.9 * total / most)


@dataclass(frozen=True, eq=False)
class CellPoints:
    """Source of the points of one segment."""

    round: int
    segment: int
    """The segment's round and its index therein."""
    cells: NDArray[np.int64]
    """(m,) int64: its cells, as indices of `Snapshot.casing`."""
    cell_mass: NDArray[np.float64]
    """(m,) float64: their masses (kg)."""
    modes: NDArray[np.float64]
    """(m, 8, 9) float64: coefficients of position (m), velocity (m/s) and `MaterialPoints.reference` (m) in them."""
    number: NDArray[np.int64]
    """(m,) int64: points of each cell."""

    @classmethod
    def of_segment(
        cls,
        owner: tuple[int, int],
        cells: NDArray[np.int64],
        cell_mass: NDArray[np.float64],
        corners: NDArray[np.float64],
        node_velocity: NDArray[np.float64],
        reference: NDArray[np.float64],
        number: NDArray[np.int64],
    ) -> CellPoints:
        """Source for the segment `owner` (round, index) from the state and the reference (m, 8, 3) at the nodes."""
        made = modes(np.concatenate([corners, node_velocity, reference], axis=2))
        return cls(*owner, cells, cell_mass, made, number)

    def draw(self, generator: np.random.Generator) -> MaterialPoints:
        """Points of one realisation, cell by cell."""
        made = PointArrays(self.number)
        shift = generator.random((self.number.size, 3))
        sample_cells(self.modes, made.offset, self.cell_mass, self.cells, shift, made.values, made.mass, made.cell)
        return made.of_segment(self.round, self.segment)


POINTS_TOGETHER = 4
"""The number of points of a ring is a multiple of this."""


@dataclass(frozen=True, eq=False)
class RingPoints:
    """Source of the points of one segment."""

    segment: int
    """The segment's index; the round is the only one."""
    cells: NDArray[np.int64]
    """(m,) int64: its rings, as indices of `Snapshot.casing`."""
    cell_mass: NDArray[np.float64]
    """(m,) float64: their masses (kg)."""
    reference: NDArray[np.float64]
    """(m, 4, 2) float64: radius and height of the nodes before the burst (m), counter-clockwise."""
    state: NDArray[np.float64]
    """(m, 4, 4) float64: radius and height (m), radial and axial velocity (m/s) of the nodes now."""
    number: NDArray[np.int64]
    """(m,) int64: points of each ring: a multiple of `POINTS_TOGETHER`."""
    half: HalfPlane
    """The half plane of the meridian."""

    def draw(self, generator: np.random.Generator) -> MaterialPoints:
        """Points of one realisation, ring by ring."""
        made = PointArrays(self.number)
        shift = generator.random((self.number.size, 3))
        sample_rings(
            self._modes, self._mean, self._density, made.offset, self.cell_mass, self.cells, shift, self.half.origin,
            self.half.frame, made.values, made.mass, made.cell,
        )  # fmt: skip
        return made.of_segment(0, self.segment)

    @cached_property
    def _modes(self) -> NDArray[np.float64]:
        return modes(np.concatenate([self.state, self.reference], axis=2))

    @cached_property
    def _mean(self) -> NDArray[np.float64]:
        return np.asarray(np.einsum("ma,maj->mj", node_shares(self.reference), self.state))

    @cached_property
    def _density(self) -> NDArray[np.float64]:
        return mass_density(self.reference)
