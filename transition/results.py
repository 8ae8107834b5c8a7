"""What the break-up hands back: rounds, segments, and one realisation of both."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from flight.fragments import Fragments
    from transition.cells.points import MaterialPoints
    from transition.law.samplers import Draw
    from transition.law.segment_law import SegmentLaw
    from transition.law.segments import CasingSegment
    from transition.ledger import BreakUpLedger
    from transition.placement.directions import Directions
    from transition.placement.isometry import Attitude
    from transition.placement.mirroring import Image
    from transition.placement.placing import Clusters


@dataclass(frozen=True, eq=False)
class BrokenRound:
    """A round whose casing breaks up: one of those computed, or an image of one behind planes of symmetry."""

    name: str
    """Its own, or that of the image."""
    computed: int
    """Number of the computed round."""
    image: Image | None
    """Where it is mirrored; None for a computed round."""
    mirror_of: str | None
    """Name of the computed round that it is an image of; None for a computed round."""
    axis: tuple[float, float, float]
    """Direction from the base to the nose."""


@dataclass(frozen=True, eq=False)
class SegmentResult:
    """A segment, its law, and the fragments drawn from it.

    Attributes
    ----------
    round : int
        Of `BreakUp.rounds`: another than the segment's own where that is mirrored.
    segment, law, draw : CasingSegment, SegmentLaw, Draw
        The segment, how it breaks, and the masses drawn.
    fragments, points : int
        Number of fragments, and of the material points that they share.
    resolved : float
        Mass (kg) from which on every fragment spans eight points or more.
    """

    round: int
    segment: CasingSegment
    law: SegmentLaw
    draw: Draw
    fragments: int
    points: int
    resolved: float


@dataclass(frozen=True, eq=False)
class BreakUpResult:
    """One realisation of the break-up.

    Attributes
    ----------
    fragments : flight.fragments.Fragments
        By round, segment and falling mass; computed rounds first, then their images.
    segments : tuple of SegmentResult
        Law and draw of every segment, of computed rounds and images.
    points : MaterialPoints
        Of every segment and every image, where the computed casing has them: neither mirrored nor moved.
    clusters : Clusters
        Which of them each fragment has.
    attitude : Attitude
        How all fragments were turned about the round's axis, and tilted.
    directions : tuple of (int, Directions)
        Directions by mass of each round that has fragments.
    ledger : BreakUpLedger
        Mass, momentum and energy handed over.
    ledgers : tuple of (int, BreakUpLedger)
        The same of each round that has fragments.
    summary : dict
        The "break_up" part of summary.json; SI units.
    """

    fragments: Fragments
    segments: tuple[SegmentResult, ...]
    points: MaterialPoints
    clusters: Clusters
    attitude: Attitude
    directions: tuple[tuple[int, Directions], ...]
    ledger: BreakUpLedger
    ledgers: tuple[tuple[int, BreakUpLedger], ...]
    summary: dict[str, Any]
