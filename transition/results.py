"""What the break-up hands back: rounds, segments, one realisation, and the comparison of it with the casing.

Compared are mass, momentum and energy (`BreakUpLedger`), and directions of flight by mass (`Directions`).
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from transition.cells import interpolated, mass_density

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.law.count_fit import CountFit
    from transition.law.segments import CasingSegment, SegmentLaw
    from transition.motion import Image, Isometry
    from transition.placing import Clusters
    from transition.points import MaterialPoints
    from transition.settings import BreakUpSettings

    Array = NDArray[np.float64]
    Vector = tuple[float, float, float]
    Shares = tuple[Array, Array]


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
    axis: Vector
    """Direction from the base to the nose."""


@dataclass(frozen=True, eq=False)
class SegmentResult:
    """A segment, its law, and the fragments drawn from it."""

    round: int
    """Of `BreakUp.rounds`: another than the segment's own where that is mirrored."""
    segment: CasingSegment
    law: SegmentLaw
    mass: Array
    """(n,) float64: masses drawn (kg), falling."""
    points: MaterialPoints
    """Where the computed casing has them: neither mirrored nor moved."""
    clusters: Clusters
    """Which of them each fragment has."""


@dataclass(frozen=True, eq=False)
class BreakUpResult:
    """One realisation of the break-up."""

    fragments: Fragments
    """By round, segment and falling mass; computed rounds first, then their images."""
    segments: tuple[SegmentResult, ...]
    """Law, masses and points of every segment, of computed rounds and images."""
    directions: dict[int, Directions]
    """Directions by mass of each round that has fragments, by its number."""
    ledger: BreakUpLedger
    """Mass, momentum and energy handed over."""
    summary: dict[str, Any]
    """The "break_up" part of summary.json; SI units."""


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
    momentum: Vector
    casing_momentum: Vector
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
    momentum: Array
    scale: float
    energy: float

    def moved(self, motion: Isometry | None) -> CasingSums:
        """The sums of the casing after a rotation or behind planes of symmetry; the scale is left as it is."""
        return self if motion is None else replace(self, momentum=motion.vector(self.momentum))

    def __add__(self, other: CasingSums) -> CasingSums:
        return CasingSums(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


def casing_sums(cell_mass: Array, node_velocity: Array) -> CasingSums:
    """Sums over casing cells: masses (m,) in kg, velocities of their nodes (m, 8, 3) in m/s."""
    squares = np.einsum("ckj,ckj->ck", node_velocity, node_velocity)
    momentum, scale = cell_mass @ node_velocity.mean(axis=1), float(cell_mass @ np.sqrt(squares).mean(axis=1))
    return CasingSums(float(cell_mass.sum()), momentum, scale, 0.5 * float(cell_mass @ squares.mean(axis=1)))


def ring_sums(ring_mass: Array, shares: Array, velocity: Array, axis: Array) -> CasingSums:
    """Sums over the rings of an axisymmetric casing.

    `ring_mass` (m,), `shares` (m, 4): masses (kg) and their shares at the nodes (`transition.cells.node_shares`);
    `velocity` (m, 4, 2): radial and axial velocity of the nodes (m/s); `axis` (3,): unit axis of the round.
    """
    nodal = ring_mass[:, None] * shares
    squares = (velocity**2).sum(axis=2)
    momentum, scale = float((nodal * velocity[..., 1]).sum()) * axis, float((nodal * np.sqrt(squares)).sum())
    return CasingSums(float(ring_mass.sum()), momentum, scale, 0.5 * float((nodal * squares).sum()))


def ledger(fragments: Fragments, casing: CasingSums) -> BreakUpLedger:
    """Compare fragments, as handed over, with the sums of the casing that they were made from."""
    mass, velocity = fragments.mass, fragments.velocity
    total, momentum = float(mass.sum()), mass @ velocity
    energy = 0.5 * float(mass @ np.einsum("ij,ij->i", velocity, velocity))
    missing = float(np.linalg.norm(momentum - casing.momentum))
    return BreakUpLedger(
        total, casing.mass, (total - casing.mass) / casing.mass,
        _vector(momentum), _vector(casing.momentum), missing / casing.scale if casing.scale > 0.0 else 0.0,
        energy, casing.energy, (energy - casing.energy) / casing.energy if casing.energy > 0.0 else 0.0,
    )  # fmt: skip


def _vector(values: Array) -> Vector:
    x, y, z = (float(value) for value in values)
    return x, y, z


_BIN = 5.0
_SAMPLES = 4  # along each side of a cell: columns of cells may be as wide as a bin
_CONES, _TURNS = 1440, 360  # polar angles and azimuths that the directions of rings are gathered at


class Directions(NamedTuple):
    """Shares of the mass by direction, of a round's fragments and of its casing cells."""

    polar_deg: Array
    """(36,) float64: centres of the bins of the angle between velocity and the round's axis (degrees; 0 beyond the
    nose)."""
    polar_fragments: Array
    polar_cells: Array
    """(36,) float64: shares of the mass in them."""
    azimuth_deg: Array
    """(72,) float64: bins of the horizontal direction from +x counter-clockwise, named by their centre (degrees)."""
    azimuth_fragments: Array
    azimuth_cells: Array
    """(72,) float64: shares of the mass in them; what flies straight up or down or stands still has none."""


def cell_shares(cell_mass: Array, node_velocity: Array, axis: Vector) -> Shares:
    """Shares of a casing's mass by polar angle (36,) and azimuth (72,), with the velocity's change inside the cells.

    `cell_mass` (m,), `node_velocity` (m, 8, 3): casing cells and the velocities of their nodes (kg, m/s). Each cell is
    taken at the middles of 4 x 4 x 4 equal parts: one velocity a cell would show the columns of cells instead of the
    velocity field; `axis`: axis of the round, from which polar angles count.
    """
    polar, azimuth = np.zeros(36), np.zeros(72)
    for index in np.ndindex((_SAMPLES,) * 3):
        point = np.broadcast_to((np.array(index) + 0.5) / _SAMPLES, (len(cell_mass), 3))
        found = _shares(cell_mass, interpolated(node_velocity, point), np.asarray(axis))
        polar += found[0] / _SAMPLES**3
        azimuth += found[1] / _SAMPLES**3
    return polar, azimuth


def ring_shares(ring_mass: Array, reference: Array, node_velocity: Array, axis: Vector) -> Shares:
    """The same of an axisymmetric casing: its rings fly on cones around the round's axis.

    `ring_mass` (m,): masses of the rings (kg); `reference` (m, 4, 2): radius and height of the nodes before the burst
    (m), by which the mass is distributed; `node_velocity` (m, 4, 2): radial and axial velocity of the nodes now (m/s).
    Each ring is taken at the middles of 4 x 4 equal parts of its reference square; by azimuth the mass is gathered on
    cones an eighth of a degree apart; `axis`: axis of the round.
    """
    middles = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    powers = (2.0 * middles[:, None] - 1.0) ** np.arange(3)
    weight = np.einsum("mij,ai,bj->mab", mass_density(reference), powers, powers)
    weight *= (ring_mass / weight.sum(axis=(1, 2)))[:, None, None]
    polar, cones = np.zeros(36), np.zeros(_CONES)
    for a, b in np.ndindex(_SAMPLES, _SAMPLES):
        velocity = interpolated(node_velocity, np.broadcast_to([middles[a], middles[b]], (len(ring_mass), 2)))
        moving = np.hypot(velocity[:, 0], velocity[:, 1]) > 0.0
        angle = np.degrees(np.arctan2(np.abs(velocity[moving, 0]), velocity[moving, 1]))
        mass = weight[moving, a, b]
        polar += _by_polar_angle(angle, mass)
        cones += np.bincount(np.minimum(angle * (_CONES / 180.0), _CONES - 1).astype(int), mass, minlength=_CONES)
    used = np.flatnonzero(cones)
    angle = np.radians((used + 0.5) * 180.0 / _CONES)
    unit = np.asarray(axis) / np.linalg.norm(axis)
    # For an upright axis the turns begin at +x, so that none lies on a bound between sectors.
    start = np.eye(3)[0 if abs(unit[0]) < 0.9 else 1]
    first = start - (start @ unit) * unit
    first /= np.linalg.norm(first)
    turn = 2.0 * np.pi * np.arange(_TURNS) / _TURNS
    circle = np.cos(turn)[:, None] * first + np.sin(turn)[:, None] * np.cross(unit, first)
    direction = np.sin(angle)[:, None, None] * circle + np.cos(angle)[:, None, None] * unit
    each = np.repeat(cones[used] / _TURNS, _TURNS)
    return polar / ring_mass.sum(), _shares(each, direction.reshape(-1, 3), unit)[1] * (cones.sum() / ring_mass.sum())


def compare_directions(mass: Array, velocity: Array, cells: Shares, axis: Vector) -> Directions:
    """Directions of a round's fragments, of `mass` (n,) in kg and `velocity` (n, 3), beside those of its casing.

    `cells`: `cell_shares` or `ring_shares` of the casing; `axis`: axis of the round.
    """
    polar, azimuth = _shares(mass, velocity, np.asarray(axis))
    return Directions(
        np.arange(0.5 * _BIN, 180.0, _BIN), polar, cells[0], np.arange(0.0, 360.0, _BIN), azimuth, cells[1]
    )


def _shares(mass: Array, velocity: Array, axis: Array) -> Shares:
    speed = np.linalg.norm(velocity, axis=1)
    moving = speed > 0.0
    cosine = velocity[moving] @ axis / (speed[moving] * np.linalg.norm(axis))
    polar = _by_polar_angle(np.degrees(np.arccos(np.clip(cosine, -1.0, 1.0))), mass[moving])
    level = np.hypot(velocity[:, 0], velocity[:, 1]) > 1e-9 * speed
    bearing = np.degrees(np.arctan2(velocity[level, 1], velocity[level, 0]))
    azimuth = np.bincount(np.round(bearing / _BIN).astype(int) % 72, mass[level], minlength=72)
    return polar / mass.sum(), azimuth / mass.sum()


def _by_polar_angle(angle: Array, mass: Array) -> Array:
    number = np.minimum(angle // _BIN, 180.0 / _BIN - 1).astype(int)
    return np.asarray(np.bincount(number, mass, minlength=36), dtype=np.float64)


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
    law = settings.mean_mass if isinstance(settings.mean_mass, str) else "given"
    factor, source = settings.factor if fit is None else (fit.factor, fit.label)
    if fit is not None and settings.mean_mass_factor is not None:
        factor, source = settings.mean_mass_factor, "input"
    return {
        **_counted(results),
        **{name: getattr(handed_over, name) for name in ("mass", "mass_error", "momentum_error", "energy_error")},
        "mean_mass": {
            "law": law if fit is None else "fitted",
            "factor": factor,
            "factor_source": source,
            "outside_data": [{"round": name, "text": text} for name, texts in outside.items() for text in texts],
            **({} if fit is None else {"test": fit.summary()}),
        },
        "tilt_deviation": settings.tilt,
        "rounds": [
            {
                "name": rounds[number].name,
                "mirror_of": rounds[number].mirror_of,
                **_counted(own),
                "directions": {name: values.tolist() for name, values in found._asdict().items()},
                "segments": [_segment_summary(result) for result in own],
            }
            for number, found in directions.items()
            for own in ([result for result in results if result.round == number],)
        ],
    }


def _counted(results: Sequence[SegmentResult]) -> dict[str, Any]:
    return {"fragments": sum(r.mass.size for r in results), "mass": float(sum(r.mass.sum() for r in results))}


def _segment_summary(result: SegmentResult) -> dict[str, Any]:
    law = result.law.law
    return {
        "name": result.segment.data.name,
        "mean_mass": law.mean,
        "mu": law.parts[0].mu,
        "n0": result.law.n0,
        "parts": [{"dimension": p.dimension, "mu": p.mu, "mass_fraction": p.weight} for p in law.parts],
        **_counted([result]),
        "speed": result.segment.data.speed,
    }
