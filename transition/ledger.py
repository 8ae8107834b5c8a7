"""What is handed over: mass, momentum and energy of the fragments against the finite-element casing."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["Ledger", "ledger"]


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


def ledger(
    fragment_mass: NDArray[np.float64],
    fragment_velocity: NDArray[np.float64],
    cell_mass: NDArray[np.float64],
    node_velocity: NDArray[np.float64],
) -> Ledger:
    """Compare fragments with the casing.

    Parameters
    ----------
    fragment_mass, fragment_velocity : (n,), (n, 3)
        Fragments (kg, m/s).
    cell_mass, node_velocity : (m,), (m, 8, 3)
        Casing cells and the velocities of their nodes (kg, m/s).
    """
    mass, casing_mass = float(fragment_mass.sum()), float(cell_mass.sum())
    momentum = fragment_mass @ fragment_velocity
    cell_velocity = node_velocity.mean(axis=1)
    casing_momentum = cell_mass @ cell_velocity
    squares = np.einsum("ckj,ckj->ck", node_velocity, node_velocity)
    scale = float(cell_mass @ np.sqrt(squares).mean(axis=1))
    energy = 0.5 * float(fragment_mass @ np.einsum("ij,ij->i", fragment_velocity, fragment_velocity))
    casing_energy = 0.5 * float(cell_mass @ squares.mean(axis=1))
    difference = float(np.linalg.norm(momentum - casing_momentum))
    return Ledger(
        mass=mass,
        casing_mass=casing_mass,
        mass_error=(mass - casing_mass) / casing_mass,
        momentum=_triple(momentum),
        casing_momentum=_triple(casing_momentum),
        momentum_error=difference / scale if scale > 0.0 else 0.0,
        energy=energy,
        casing_energy=casing_energy,
        energy_error=(energy - casing_energy) / casing_energy if casing_energy > 0.0 else 0.0,
        cell_energy=0.5 * float(cell_mass @ np.einsum("ij,ij->i", cell_velocity, cell_velocity)),
    )


def _triple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
