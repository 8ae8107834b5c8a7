"""What the break-up hands back: rounds, segments, one realisation, its ledger, and its part of summary.json."""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.cells.points import MaterialPoints
    from transition.law.count_fit import CountFit
    from transition.law.segment_law import SegmentLaw
    from transition.law.segments import CasingSegment
    from transition.placement.directions import Directions
    from transition.placement.isometry import Isometry
    from transition.placement.mirroring import Image
    from transition.placement.placing import Clusters
    from transition.settings import BreakUpSettings


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
    """A segment, its law, and the fragments drawn from it."""

    round: int
    """Of `BreakUp.rounds`: another than the segment's own where that is mirrored."""
    segment: CasingSegment
    law: SegmentLaw
    mass: NDArray[np.float64]
    """(n,) float64: masses drawn (kg), falling."""


@dataclass(frozen=True, eq=False)
class BreakUpResult:
    """One realisation of the break-up.

    Attributes
    ----------
    fragments : flight.fragments.Fragments
        By round, segment and falling mass; computed rounds first, then their images.
    segments : tuple of SegmentResult
        Law and masses of every segment, of computed rounds and images.
    points : MaterialPoints
        Of every segment and every image, where the computed casing has them: neither mirrored nor moved.
    clusters : Clusters
        Which of them each fragment has.
    directions : dict
        Directions by mass of each round that has fragments, by its number.
    ledger : BreakUpLedger
        Mass, momentum and energy handed over.
    summary : dict
        The "break_up" part of summary.json; SI units.
    """

    fragments: Fragments
    segments: tuple[SegmentResult, ...]
    points: MaterialPoints
    clusters: Clusters
    directions: dict[int, Directions]
    ledger: BreakUpLedger
    summary: dict[str, Any]


@dataclass(frozen=True)
class BreakUpLedger:
    """Mass, momentum and energy before and after. SI units.

    The casing's momentum and energy are those of its lumped nodal masses (an eighth of each cell's mass at each of
    its nodes; for a ring the integral of rho N_a 2 pi r dA), as the burst stage steps them.
    """

    mass: float
    casing_mass: float
    """Of the fragments and of the casing cells (kg)."""
    mass_error: float
    """(mass - casing_mass)/casing_mass."""
    momentum: tuple[float, float, float]
    casing_momentum: tuple[float, float, float]
    """Vector sums (kg m/s)."""
    momentum_error: float
    """Length of the difference over the casing's sum of mass times speed, since opposite sides cancel in the momentum
    itself."""
    energy: float
    casing_energy: float
    """Kinetic (J)."""
    energy_error: float
    """(energy - casing_energy)/casing_energy; 0 for a casing at rest."""


@dataclass(frozen=True)
class CasingSums:
    """Sums over a casing, see `BreakUpLedger`: mass (kg), momentum (kg m/s), sum of mass times speed, energy (J)."""

    mass: float
    momentum: NDArray[np.float64]
    scale: float
    energy: float

    def moved(self, motion: Isometry) -> CasingSums:
        """The sums of the casing after a rotation or behind planes of symmetry; the scale is left as it is."""
        return replace(self, momentum=motion.vector(self.momentum))

    def __add__(self, other: CasingSums) -> CasingSums:
        return CasingSums(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


def casing_sums(cell_mass: NDArray[np.float64], node_velocity: NDArray[np.float64]) -> CasingSums:
    """Sums over casing cells: masses (m,) in kg, velocities of their nodes (m, 8, 3) in m/s."""
    squares = np.einsum("ckj,ckj->ck", node_velocity, node_velocity)
    speed = np.sqrt(squares)
    return CasingSums(
        mass=float(cell_mass.sum()),
        momentum=cell_mass @ node_velocity.mean(axis=1),
        scale=float(cell_mass @ speed.mean(axis=1)),
        energy=0.5 * float(cell_mass @ squares.mean(axis=1)),
    )


def ring_sums(
    ring_mass: NDArray[np.float64],
    shares: NDArray[np.float64],
    velocity: NDArray[np.float64],
    axis: NDArray[np.float64],
) -> CasingSums:
    """Sums over the rings of an axisymmetric casing.

    `ring_mass` (m,), `shares` (m, 4): masses (kg) and their shares at the nodes
    (`transition.cells.meridian.node_shares`); `velocity` (m, 4, 2): radial and axial velocity of the nodes (m/s);
    `axis` (3,): unit axis of the round.
    """
    nodal = ring_mass[:, None] * shares
    squares = (velocity**2).sum(axis=2)
    return CasingSums(
        mass=float(ring_mass.sum()),
        momentum=float((nodal * velocity[..., 1]).sum()) * axis,
        scale=float((nodal * np.sqrt(squares)).sum()),
        energy=0.5 * float((nodal * squares).sum()),
    )


def ledger(fragments: Fragments, casing: CasingSums) -> BreakUpLedger:
    """Compare fragments, as handed over, with the sums of the casing that they were made from."""
    mass, velocity = fragments.mass, fragments.velocity
    total = float(mass.sum())
    momentum = mass @ velocity
    energy = 0.5 * float(mass @ np.einsum("ij,ij->i", velocity, velocity))
    difference = float(np.linalg.norm(momentum - casing.momentum))
    return BreakUpLedger(
        mass=total,
        casing_mass=casing.mass,
        mass_error=(total - casing.mass) / casing.mass,
        momentum=_triple(momentum),
        casing_momentum=_triple(casing.momentum),
        momentum_error=difference / casing.scale if casing.scale > 0.0 else 0.0,
        energy=energy,
        casing_energy=casing.energy,
        energy_error=(energy - casing.energy) / casing.energy if casing.energy > 0.0 else 0.0,
    )


def _triple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])


def summarised(
    rounds: Sequence[BrokenRound], results: Sequence[SegmentResult], directions: Mapping[int, Directions],
    handed_over: BreakUpLedger, settings: BreakUpSettings, outside: Mapping[str, Sequence[str]],
    fit: CountFit | None = None,
) -> dict[str, Any]:  # fmt: skip
    """Numbers of one realisation.

    `rounds`: computed rounds, then mirrored ones; `results`: segments of all of them; `directions`: by the number of
    each round that has fragments; `outside`: by a round's name, in which respects no published data on mean masses are
    near it; `fit`: of the mean masses to the pieces of a test.
    """
    return {
        "fragments": sum(r.mass.size for r in results),
        "mass": handed_over.mass,
        "mass_error": handed_over.mass_error,
        "momentum_error": handed_over.momentum_error,
        "energy_error": handed_over.energy_error,
        "mean_mass": _mean_mass(settings, fit, outside),
        "tilt_deviation": settings.tilt,
        "rounds": [
            _round_summary(rounds[number], [r for r in results if r.round == number], found)
            for number, found in directions.items()
        ],
    }


def _mean_mass(settings: BreakUpSettings, fit: CountFit | None, outside: Mapping[str, Sequence[str]]) -> dict[str, Any]:
    if fit is None:
        factor, source = settings.factor
    elif settings.mean_mass_factor is None:
        factor, source = fit.factor, fit.label
    else:
        factor, source = settings.mean_mass_factor, "input"
    law = settings.mean_mass if isinstance(settings.mean_mass, str) else "given"
    return {
        "law": law if fit is None else "fitted",
        "factor": factor,
        "factor_source": source,
        "outside_data": [{"round": name, "text": text} for name, texts in outside.items() for text in texts],
        **({} if fit is None else {"test": fit.summary()}),
    }


def _round_summary(broken: BrokenRound, results: Sequence[SegmentResult], directions: Directions) -> dict[str, Any]:
    return {
        "name": broken.name,
        "mirror_of": broken.mirror_of,
        "fragments": sum(r.mass.size for r in results),
        "mass": float(sum(r.mass.sum() for r in results)),
        "directions": {name: values.tolist() for name, values in directions._asdict().items()},
        "segments": [_segment_summary(r) for r in results],
    }


def _segment_summary(result: SegmentResult) -> dict[str, Any]:
    law = result.law.law
    return {
        "name": result.segment.data.name,
        "mean_mass": law.mean,
        "mu": law.parts[0].mu,
        "n0": result.law.n0,
        "parts": [{"dimension": p.dimension, "mu": p.mu, "mass_fraction": p.weight} for p in law.parts],
        "fragments": result.mass.size,
        "mass": float(result.mass.sum()),
        "speed": result.segment.data.speed,
    }
