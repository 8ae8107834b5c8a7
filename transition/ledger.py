"""What is handed over: mass, momentum and energy of the fragments against the finite-element casing.

Mirrored rounds are held against the mirrored field: its sums are those of the computed casing, the momentum reflected.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.mirroring import Image

__all__ = ["CasingSums", "Ledger", "casing_sums", "ledger"]


@dataclass(frozen=True)
class Ledger:
    """Mass, momentum and energy before and after. SI units.

    The casing's momentum and energy are those of its lumped nodal masses (an eighth of each cell's mass at each of
    its nodes), as the burst stage steps them.

    Attributes
    ----------
    mass, casing_mass : float
        Of the fragments and of the casing cells (kg).
    mass_error : float
        (mass - casing_mass)/casing_mass.
    momentum, casing_momentum : tuple of float
        Vector sums (kg m/s).
    momentum_error : float
        Length of the difference over the casing's sum of mass times speed, since opposite sides cancel in the
        momentum itself.
    energy, casing_energy : float
        Kinetic (J).
    energy_error : float
        (energy - casing_energy)/casing_energy; 0 for a casing at rest.
    cell_energy : float
        Kinetic energy of the cells moving as one piece each (J). Fragments smaller than a cell keep more of the
        casing's energy, those of many cells less.
    """

    mass: float
    casing_mass: float
    mass_error: float
    momentum: tuple[float, float, float]
    casing_momentum: tuple[float, float, float]
    momentum_error: float
    energy: float
    casing_energy: float
    energy_error: float
    cell_energy: float


@dataclass(frozen=True)
class CasingSums:
    """Mass (kg), momentum (kg m/s), sum of mass times speed and energies (J) of a casing; see `Ledger`."""

    mass: float
    momentum: NDArray[np.float64]
    scale: float
    energy: float
    cell_energy: float

    def mirrored(self, image: Image) -> CasingSums:
        """The sums of the casing's image behind planes of symmetry."""
        return replace(self, momentum=image.vector(self.momentum))

    def __add__(self, other: CasingSums) -> CasingSums:
        return CasingSums(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


def casing_sums(cell_mass: NDArray[np.float64], node_velocity: NDArray[np.float64]) -> CasingSums:
    """Sums over casing cells, masses (m,) and velocities of their nodes (m, 8, 3), in kg and m/s."""
    cell_velocity = node_velocity.mean(axis=1)
    squares = np.einsum("ckj,ckj->ck", node_velocity, node_velocity)
    return CasingSums(
        mass=float(cell_mass.sum()),
        momentum=cell_mass @ cell_velocity,
        scale=float(cell_mass @ np.sqrt(squares).mean(axis=1)),
        energy=0.5 * float(cell_mass @ squares.mean(axis=1)),
        cell_energy=0.5 * float(cell_mass @ np.einsum("ij,ij->i", cell_velocity, cell_velocity)),
    )


def ledger(fragment_mass: NDArray[np.float64], fragment_velocity: NDArray[np.float64], casing: CasingSums) -> Ledger:
    """Compare fragments (n,), (n, 3), kg and m/s, with the sums of the casing that they were made from."""
    mass = float(fragment_mass.sum())
    momentum = fragment_mass @ fragment_velocity
    energy = 0.5 * float(fragment_mass @ np.einsum("ij,ij->i", fragment_velocity, fragment_velocity))
    difference = float(np.linalg.norm(momentum - casing.momentum))
    return Ledger(
        mass=mass,
        casing_mass=casing.mass,
        mass_error=(mass - casing.mass) / casing.mass,
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
