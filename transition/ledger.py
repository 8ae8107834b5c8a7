"""What is handed over: mass, momentum and energy of the fragments against the finite-element casing.

Mirrored rounds are held against the mirrored field: its sums are those of the computed casing, the momentum reflected.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.placement.isometry import Isometry


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
    cell_energy: float
    """Kinetic energy of the cells moving as one piece each (J), rings by their cross-section. Fragments smaller than a
    cell keep more of the casing's energy, those of many cells less."""


@dataclass(frozen=True)
class CasingSums:
    """Sums over a casing, see `BreakUpLedger`: mass (kg), momentum (kg m/s), sum of mass times speed, energies (J)."""

    mass: float
    momentum: NDArray[np.float64]
    scale: float
    energy: float
    cell_energy: float

    def moved(self, motion: Isometry) -> CasingSums:
        """The sums of the casing after a rotation or behind planes of symmetry; the scale is left as it is."""
        return replace(self, momentum=motion.vector(self.momentum))

    def __add__(self, other: CasingSums) -> CasingSums:
        return CasingSums(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


def casing_sums(cell_mass: NDArray[np.float64], node_velocity: NDArray[np.float64]) -> CasingSums:
    """Sums over casing cells: masses (m,) in kg, velocities of their nodes (m, 8, 3) in m/s."""
    cell_velocity = node_velocity.mean(axis=1)
    squares = np.einsum("ckj,ckj->ck", node_velocity, node_velocity)
    speed = np.sqrt(squares)
    return CasingSums(
        mass=float(cell_mass.sum()),
        momentum=cell_mass @ cell_velocity,
        scale=float(cell_mass @ speed.mean(axis=1)),
        energy=0.5 * float(cell_mass @ squares.mean(axis=1)),
        cell_energy=0.5 * float(cell_mass @ np.einsum("ij,ij->i", cell_velocity, cell_velocity)),
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
    mean = np.einsum("ma,maj->mj", shares, velocity)
    return CasingSums(
        mass=float(ring_mass.sum()),
        momentum=float((nodal * velocity[..., 1]).sum()) * axis,
        scale=float((nodal * np.sqrt(squares)).sum()),
        energy=0.5 * float((nodal * squares).sum()),
        cell_energy=0.5 * float(ring_mass @ (mean**2).sum(axis=1)),
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
        cell_energy=casing.cell_energy,
    )


def _triple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
