"""Material points from the rings of an axisymmetric burst: random positions in every quadrilateral and around the axis.

The state goes straight to points around the axis; no hexahedra stand between. A ring's mass is distributed as the burst
stage lumps it, by r dA over its reference quadrilateral. Its points share the mass equally and are placed by that
measure (`kernels.sampling`); every block of four begins at an azimuth of its own, so that the fragments show
neither sectors nor columns of cells. Mass, axial momentum, centre of mass and mean radial speed are those of every ring
to round-off. Opposite points come in pairs, so that transverse momentum is zero.

The number of points follows the same rule as that of hexahedra (`transition.cells.cell_points`).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from transition.cells.interpolation import modes
from transition.cells.meridian import mass_density, node_shares
from transition.cells.points import MaterialPoints, PointArrays
from transition.kernels.sampling import sample_rings

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.cells.meridian import HalfPlane


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
