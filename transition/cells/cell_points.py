"""Material points of hexahedral cells: jittered positions in every cell, new in each realisation.

A cell's mass is spread evenly over its reference coordinates, as the lumped masses of the burst stage have it. The
points of a cell share its mass equally. They come in pairs of random places and their reflections through the cell's
centre, and what this leaves of the bilinear modes is taken from all points of a cell alike (`kernels.sampling`).
So their mean position and mean velocity are those of the cell's nodes to round-off, whatever the places: mass,
momentum and centre of mass agree with the finite-element field cell by cell.

The number of points follows the law of the segment: the lightest fragment that matters spans `POINTS_PER_FRAGMENT`.
That is the fragment above which fragments carry the share `MASS_THAT_MATTERS` of the mass. With Mott's law in two
dimensions it weighs 0.16 mean masses: about 1.8 g for a 155 mm shell, whose hazard distance is set by fragments of
10 g and more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from transition.cells.interpolation import modes
from transition.cells.points import MaterialPoints, PointArrays
from transition.kernels.sampling import sample_cells
from transition.law.mott import MottLaw, MottPart

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from transition.law.mott import Dimension


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
