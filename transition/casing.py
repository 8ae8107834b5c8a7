"""The burst casing as the break-up sees it: hexahedra, or rings around the axis of an axisymmetric burst."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from transition.points import PointSource, numbers
from transition.results import CasingSums, casing_sums, cell_shares, ring_shares, ring_sums

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from transition.law.segments import CasingSegment
    from transition.motion import Isometry
    from transition.results import Shares
    from transition.snapshot import Snapshot

    Array = NDArray[np.float64]


class HexahedralCasing:
    """Casings of hexahedra at the end of the burst; cells are indices of `Snapshot.casing`."""

    together = 2
    """The number of points of a cell is a multiple of this."""

    def __init__(self, snapshot: Snapshot) -> None:
        self._snapshot = snapshot
        self._nodes = snapshot.cells[snapshot.casing]
        self._mass = snapshot.mass[snapshot.casing]
        self._read()

    def _read(self) -> None:
        """Keep the state in the form that the cells need."""
        snapshot = self._snapshot
        self._state = np.concatenate([snapshot.position[self._nodes], snapshot.velocity[self._nodes]], axis=2)
        self._reference = snapshot.reference[self._nodes]

    def sources(self, segments: Sequence[CasingSegment], lightest: Sequence[float]) -> tuple[PointSource, ...]:
        """Source of material points of each segment, for its lightest fragment that matters (kg)."""
        number = numbers([self._mass[segment.cells] for segment in segments], lightest, together=self.together)
        return tuple(self._source(segment, count) for segment, count in zip(segments, number, strict=True))

    def _source(self, segment: CasingSegment, number: NDArray[np.int64]) -> PointSource:
        state = np.concatenate([self._state[segment.cells], self.before(segment).reshape(-1, 8, 3)], axis=2)
        return PointSource.of_cells(segment.cells, self._mass[segment.cells], number, state)

    def before(self, segment: CasingSegment) -> Array:
        """Positions (p, 3) of a segment's nodes before the burst, across and along its round's axis (m)."""
        data = self._snapshot.rounds[segment.round]
        along = data.along
        first = np.cross(along, np.eye(3)[np.abs(along).argmin()])
        first /= np.linalg.norm(first)
        frame = np.stack([first, np.cross(along, first), along])
        return np.asarray((self._reference[segment.cells].reshape(-1, 3) - np.asarray(data.position)) @ frame.T)

    def sums(self, computed: int) -> CasingSums:
        """Mass, momentum and energy of the casing of a computed round."""
        own = self._own(computed)
        return casing_sums(self._mass[own], self._state[own, :, 3:])

    def shares(self, computed: int, axis: tuple[float, float, float], motion: Isometry | None) -> Shares:
        """Shares of its mass by direction after `motion`, which carries its axis to `axis`."""
        own = self._own(computed)
        velocity = self._state[own, :, 3:]
        return cell_shares(self._mass[own], motion.vector(velocity) if motion else velocity, axis)

    def _own(self, computed: int) -> NDArray[np.bool_]:
        return self._snapshot.round[self._snapshot.casing] == computed


class RingCasing(HexahedralCasing):
    """Casing of the one round of an axisymmetric burst: rings around its axis."""

    together = 4

    def _read(self) -> None:
        snapshot, half = self._snapshot, self._snapshot.half_plane
        now = half.coordinates(snapshot.position[self._nodes]), half.components(snapshot.velocity[self._nodes])
        self._state = np.concatenate(now, axis=2)
        self._reference = half.coordinates(snapshot.reference[self._nodes])

    def _source(self, segment: CasingSegment, number: NDArray[np.int64]) -> PointSource:
        own, half = segment.cells, self._snapshot.half_plane
        return PointSource.of_rings(own, self._mass[own], number, self._reference[own], self._state[own], half)

    def before(self, segment: CasingSegment) -> Array:
        """Where their rings cross two planes through the axis."""
        radius, height = self._reference[segment.cells].reshape(-1, 2).T
        none = np.zeros_like(radius)
        sides = ((radius, none), (-radius, none), (none, radius), (none, -radius))
        return np.concatenate([np.column_stack([x, y, height]) for x, y in sides])

    def sums(self, computed: int) -> CasingSums:  # noqa: ARG002 - there is one round
        """Mass, momentum and energy of the casing."""
        snapshot = self._snapshot
        return ring_sums(self._mass, snapshot.ring_shares, self._state[..., 2:], snapshot.half_plane.frame[2])

    def shares(self, computed: int, axis: tuple[float, float, float], motion: Isometry | None) -> Shares:  # noqa: ARG002
        """Shares of its mass by direction; turned about its axis it is the same, so that this alone counts."""
        return ring_shares(self._mass, self._reference, self._state[..., 2:], axis)


def casing_of(snapshot: Snapshot) -> HexahedralCasing:
    """The casing of a snapshot, in the form that its geometry has."""
    return RingCasing(snapshot) if snapshot.is_axisymmetric else HexahedralCasing(snapshot)
