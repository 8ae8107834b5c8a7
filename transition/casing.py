"""The burst casing as the break-up sees it: hexahedra, or rings around the axis of an axisymmetric burst.

Both give sources of material points, sums for the ledger and directions by mass; the break-up does not know which it
has.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Protocol

import numpy as np

from transition.cells.points import POINTS_TOGETHER, CellPoints, RingPoints, numbers
from transition.placement.directions import Shares, cell_shares, ring_shares
from transition.results import CasingSums, casing_sums, ring_sums

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from transition.cells.points import PointSource
    from transition.law.segments import CasingSegment
    from transition.placement.isometry import Isometry
    from transition.snapshot import Snapshot


class Casing(Protocol):
    """State of the casings at the end of the burst; cells are indices of `Snapshot.casing`."""

    def sources(self, segments: Sequence[CasingSegment], lightest: Sequence[float]) -> tuple[PointSource, ...]:
        """Source of material points of each segment, for its lightest fragment that matters (kg)."""
        ...

    def before(self, segment: CasingSegment) -> NDArray[np.float64]:
        """Positions (p, 3) of a segment's nodes before the burst, across and along its round's axis (m)."""
        ...

    def sums(self, computed: int) -> CasingSums:
        """Mass, momentum and energy of the casing of a computed round."""
        ...

    def shares(self, computed: int, axis: tuple[float, float, float], motion: Isometry | None) -> Shares:
        """Shares of its mass by direction after `motion`, which carries its axis to `axis`."""
        ...


class HexahedralCasing:
    """Casings of hexahedra."""

    def __init__(self, snapshot: Snapshot) -> None:
        nodes = snapshot.cells[snapshot.casing]
        self._snapshot = snapshot
        self._mass = snapshot.mass[snapshot.casing]
        self._corners, self._velocity = snapshot.position[nodes], snapshot.velocity[nodes]
        self._reference = snapshot.reference[nodes]

    def sources(self, segments: Sequence[CasingSegment], lightest: Sequence[float]) -> tuple[PointSource, ...]:
        """See `Casing`."""
        masses = [self._mass[segment.cells] for segment in segments]
        number = numbers(masses, lightest)
        return tuple(
            CellPoints.of_segment(
                (s.round, s.index), s.cells, mass, self._corners[s.cells], self._velocity[s.cells],
                self.before(s).reshape(-1, 8, 3), count,
            )
            for s, mass, count in zip(segments, masses, number, strict=True)
        )  # fmt: skip

    def before(self, segment: CasingSegment) -> NDArray[np.float64]:
        """See `Casing`; cell by cell, from the centre of the base."""
        data = self._snapshot.rounds[segment.round]
        along = np.asarray(data.axis) / np.linalg.norm(data.axis)
        first = np.cross(along, np.eye(3)[np.abs(along).argmin()])
        first /= np.linalg.norm(first)
        frame = np.stack([first, np.cross(along, first), along])
        return np.asarray((self._reference[segment.cells].reshape(-1, 3) - np.asarray(data.position)) @ frame.T)

    def sums(self, computed: int) -> CasingSums:
        """See `Casing`."""
        own = self._own(computed)
        return casing_sums(self._mass[own], self._velocity[own])

    def shares(self, computed: int, axis: tuple[float, float, float], motion: Isometry | None) -> Shares:
        """See `Casing`."""
        own = self._own(computed)
        velocity = self._velocity[own]
        return cell_shares(self._mass[own], motion.vector(velocity) if motion else velocity, axis)

    def _own(self, computed: int) -> NDArray[np.bool_]:
        return self._snapshot.round[self._snapshot.casing] == computed


class RingCasing:
    """Casing of the one round of an axisymmetric burst: rings around its axis."""

    def __init__(self, snapshot: Snapshot) -> None:
        nodes = snapshot.cells[snapshot.casing]
        self._snapshot = snapshot
        self._half = snapshot.half_plane
        self._mass = snapshot.mass[snapshot.casing]
        self._reference = self._half.coordinates(snapshot.reference[nodes])
        self._state = np.concatenate(
            [self._half.coordinates(snapshot.position[nodes]), self._half.components(snapshot.velocity[nodes])], axis=2
        )

    def sources(self, segments: Sequence[CasingSegment], lightest: Sequence[float]) -> tuple[PointSource, ...]:
        """See `Casing`."""
        masses = [self._mass[segment.cells] for segment in segments]
        number = numbers(masses, lightest, together=POINTS_TOGETHER)
        return tuple(
            RingPoints(s.index, s.cells, mass, self._reference[s.cells], self._state[s.cells], count, self._half)
            for s, mass, count in zip(segments, masses, number, strict=True)
        )

    def before(self, segment: CasingSegment) -> NDArray[np.float64]:
        """See `Casing`; where their rings cross two planes through the axis."""
        radius, height = self._reference[segment.cells].reshape(-1, 2).T
        none = np.zeros_like(radius)
        sides = ((radius, none), (-radius, none), (none, radius), (none, -radius))
        return np.concatenate([np.column_stack([x, y, height]) for x, y in sides])

    def sums(self, computed: int) -> CasingSums:  # noqa: ARG002 - there is one round
        """See `Casing`."""
        return ring_sums(self._mass, self._snapshot.ring_shares, self._state[..., 2:], self._half.axis)

    def shares(self, computed: int, axis: tuple[float, float, float], motion: Isometry | None) -> Shares:  # noqa: ARG002
        """See `Casing`; turned about its axis it is the same, so that the direction of the axis is all that counts."""
        return ring_shares(self._mass, self._reference, self._state[..., 2:], axis)


def casing_of(snapshot: Snapshot) -> Casing:
    """The casing of a snapshot, in the form that its geometry has."""
    return RingCasing(snapshot) if snapshot.is_axisymmetric else HexahedralCasing(snapshot)
