"""The burst casing as material points: the one form in which hexahedra and rings are broken up.

Hexahedra. A cell's mass is spread evenly over its reference coordinates, as the lumped masses of the burst stage have
it. The points of a cell share its mass equally. They come in pairs of random places and their reflections through the
cell's centre, and what this leaves of the bilinear modes is taken from all points of a cell alike
(`kernels.sample_cells`). So their mean position and mean velocity are those of the cell's nodes to round-off, whatever
the places: mass, momentum and centre of mass agree with the finite-element field cell by cell.

Rings. The state goes straight to points around the axis; no hexahedra stand between. A ring's mass is distributed as
the burst stage lumps it, by r dA over its reference quadrilateral. Its points share the mass equally and are placed
by that measure (`kernels.sample_rings`); every block of four begins at an azimuth of its own, so that the fragments
show neither sectors nor columns of cells. Mass, axial momentum, centre of mass and mean radial speed are those of every
ring to round-off. Opposite points come in pairs, so that transverse momentum is zero.

The number of points follows the law of the segment: the lightest fragment that matters spans `POINTS_PER_FRAGMENT`.
That is the fragment above which fragments carry the share `MASS_THAT_MATTERS` of the mass. With Mott's law in two
dimensions it weighs 0.16 mean masses: about 1.8 g for a 155 mm shell, whose hazard distance is set by fragments of 10
g and more.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache, partial
from typing import TYPE_CHECKING

import numpy as np
from scipy.optimize import brentq

from transition.cells import mass_density, modes, node_shares
from transition.kernels import sample_cells, sample_rings
from transition.law.mott import MottLaw, MottPart

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

    from numpy.typing import NDArray

    from transition.cells import HalfPlane
    from transition.law.mott import Dimension

    Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class MaterialPoints:
    """Points of a casing, each with its share of the mass. SI units."""

    position: Array
    velocity: Array
    """(p, 3) float64: where they are (m) and how they move (m/s)."""
    reference: Array
    """(p, 3) float64: where they were before the burst: two coordinates across the round's axis and the height along it
    (m)."""
    mass: Array
    """(p,) float64: their masses (kg), above zero."""
    cell: NDArray[np.int64]
    """(p,) int64: the casing cell or ring they lie in, as an index of `Snapshot.casing`."""

    def __len__(self) -> int:
        return int(self.mass.size)


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
    cell_mass: Sequence[Array], lightest: Sequence[float], most: int = MOST_POINTS, *, together: int = 2
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
class PointSource:
    """Draws the material points of one segment; the same mass and momentum each time, at other positions."""

    cells: NDArray[np.int64]
    cell_mass: Array
    number: NDArray[np.int64]
    """(m,): its cells or rings, as indices of `Snapshot.casing`; their masses (kg); points of each."""
    sample: Callable[..., None]
    """A kernel of `transition.kernels` with the tables that it takes first."""

    @classmethod
    def of_cells(
        cls, cells: NDArray[np.int64], cell_mass: Array, number: NDArray[np.int64], state: Array
    ) -> PointSource:
        """Of hexahedra, from position, velocity and `MaterialPoints.reference` (m, 8, 9) of their nodes."""
        return cls(cells, cell_mass, number, partial(sample_cells, modes(state)))

    @classmethod
    def of_rings(
        cls, cells: NDArray[np.int64], cell_mass: Array, number: NDArray[np.int64], reference: Array, state: Array,
        half: HalfPlane,
    ) -> PointSource:  # fmt: skip
        """Of rings of the meridian `half`, each with a multiple of four points.

        `reference` (m, 4, 2): radius and height of the nodes before the burst (m), counter-clockwise; `state` (m, 4,
        4): the same now, and their radial and axial velocity (m/s).
        """
        mean = np.einsum("ma,maj->mj", node_shares(reference), state)
        tables = modes(np.concatenate([state, reference], axis=2)), mean, mass_density(reference)
        return cls(cells, cell_mass, number, partial(sample_rings, *tables, half.origin, half.frame))

    def draw(self, generator: np.random.Generator) -> MaterialPoints:
        """Points of one realisation, cell by cell."""
        offset = np.concatenate([[0], np.cumsum(self.number)])
        total = int(offset[-1])
        values, mass, cell = np.empty((total, 9)), np.empty(total), np.empty(total, dtype=np.int64)
        shift = generator.random((self.number.size, 3))
        self.sample(offset, self.cell_mass, self.cells, shift, values, mass, cell)
        return MaterialPoints(values[:, :3], values[:, 3:6], values[:, 6:], mass, cell)
