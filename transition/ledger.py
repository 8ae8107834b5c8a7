"""What is handed over: mass, momentum and energy of the fragments against the finite-element casing.

Mirrored rounds are held against the mirrored field: its sums are those of the computed casing, the momentum reflected.
"""

from __future__ import annotations

from dataclasses import dataclass, fields, replace
from typing import TYPE_CHECKING

import numpy as np

from transition.cells.shape_functions import field_angular_momentum, modes

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from flight.fragments import Fragments
    from transition.cells.meridian import HalfPlane
    from transition.placement.isometry import Isometry

__all__ = ["CasingSums", "BreakUpLedger", "casing_sums", "ledger", "ring_sums"]


@dataclass(frozen=True)
class BreakUpLedger:
    """Mass, momentum and energy before and after. SI units.

    The casing's momentum and energy are those of its lumped nodal masses (an eighth of each cell's mass at each of
    its nodes; for a ring the integral of rho N_a 2 pi r dA), as the burst stage steps them. Angular momentum is counted
    about the origin of coordinates; the casing's is that of the finite-element field with each cell's mass spread
    evenly over its reference coordinates, or as lumped over the ring.
    Fragments are handed over without spin: what they would have is counted here as lost.

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
    angular_momentum, spin, casing_angular_momentum : tuple of float
        Of the fragments' flight, of the fragments about their own centres of mass (lost), and of the casing
        (kg m2/s).
    angular_momentum_error : float
        Length of the first two less the third, over the casing's sum of mass times distance times speed.
    energy, casing_energy : float
        Kinetic (J).
    energy_error : float
        (energy - casing_energy)/casing_energy; 0 for a casing at rest.
    cell_energy : float
        Kinetic energy of the cells moving as one piece each (J), rings by their cross-section. Fragments smaller
        than a cell keep more of the casing's energy, those of many cells less.
    """

    mass: float
    casing_mass: float
    mass_error: float
    momentum: tuple[float, float, float]
    casing_momentum: tuple[float, float, float]
    momentum_error: float
    angular_momentum: tuple[float, float, float]
    spin: tuple[float, float, float]
    casing_angular_momentum: tuple[float, float, float]
    angular_momentum_error: float
    energy: float
    casing_energy: float
    energy_error: float
    cell_energy: float


@dataclass(frozen=True)
class CasingSums:
    """Sums over a casing: see `BreakUpLedger`.

    Mass (kg), momentum (kg m/s), sum of mass times speed, angular momentum (kg m2/s), sum of mass times distance
    times speed, and energies (J).
    """

    mass: float
    momentum: NDArray[np.float64]
    scale: float
    angular_momentum: NDArray[np.float64]
    angular_scale: float
    energy: float
    cell_energy: float

    def moved(self, motion: Isometry) -> CasingSums:
        """The sums of the casing after a rotation or behind planes of symmetry; the scale is left as it is."""
        momentum = motion.vector(self.momentum)
        angular = motion.axial_vector(self.angular_momentum) + np.cross(motion.shift, momentum)
        return replace(self, momentum=momentum, angular_momentum=angular)

    def __add__(self, other: CasingSums) -> CasingSums:
        return CasingSums(*(getattr(self, f.name) + getattr(other, f.name) for f in fields(self)))


def casing_sums(
    cell_mass: NDArray[np.float64], corners: NDArray[np.float64], node_velocity: NDArray[np.float64]
) -> CasingSums:
    """Sums over casing cells: masses (m,), positions and velocities of their nodes (m, 8, 3), in kg, m and m/s."""
    cell_velocity = node_velocity.mean(axis=1)
    squares = np.einsum("ckj,ckj->ck", node_velocity, node_velocity)
    speed = np.sqrt(squares)
    together = modes(np.concatenate([corners, node_velocity], axis=2))
    return CasingSums(
        mass=float(cell_mass.sum()),
        momentum=cell_mass @ cell_velocity,
        scale=float(cell_mass @ speed.mean(axis=1)),
        angular_momentum=field_angular_momentum(cell_mass, together, np.zeros(3)),
        angular_scale=float(cell_mass @ (np.linalg.norm(corners, axis=2) * speed).mean(axis=1)),
        energy=0.5 * float(cell_mass @ squares.mean(axis=1)),
        cell_energy=0.5 * float(cell_mass @ np.einsum("ij,ij->i", cell_velocity, cell_velocity)),
    )


def ring_sums(
    ring_mass: NDArray[np.float64], shares: NDArray[np.float64], state: NDArray[np.float64], half: HalfPlane
) -> CasingSums:
    """Sums over the rings of an axisymmetric casing.

    Parameters
    ----------
    ring_mass, shares : (m,), (m, 4)
        Masses (kg) and their shares at the nodes (`transition.cells.meridian.node_shares`).
    state : (m, 4, 4)
        Radius and height (m), radial and axial velocity (m/s) of the nodes.
    half : HalfPlane
        The half plane of the meridian.
    """
    nodal = ring_mass[:, None] * shares
    squares = (state[..., 2:] ** 2).sum(axis=2)
    speed = np.sqrt(squares)
    momentum = float((nodal * state[..., 3]).sum()) * half.axis
    # Root of the mean square distance from the origin of the circle that a node stands for
    on_axis = half.origin + state[..., 1:2] * half.axis
    distance = np.sqrt((on_axis**2).sum(axis=2) + state[..., 0] ** 2)
    mean = np.einsum("ma,maj->mj", shares, state[..., 2:])
    return CasingSums(
        mass=float(ring_mass.sum()),
        momentum=momentum,
        scale=float((nodal * speed).sum()),
        angular_momentum=np.cross(half.origin, momentum),
        angular_scale=float((nodal * distance * speed).sum()),
        energy=0.5 * float((nodal * squares).sum()),
        cell_energy=0.5 * float(ring_mass @ (mean**2).sum(axis=1)),
    )


def ledger(fragments: Fragments, spin: NDArray[np.float64], casing: CasingSums) -> BreakUpLedger:
    """Compare fragments with the sums of the casing that they were made from.

    Parameters
    ----------
    fragments : flight.fragments.Fragments
        As handed over.
    spin : (n, 3) float64
        Their angular momenta about their own centres of mass, which they lose (kg m2/s).
    casing : CasingSums
        Sums over the casing.
    """
    mass, position, velocity = fragments.mass, fragments.position, fragments.velocity
    total = float(mass.sum())
    momentum = mass @ velocity
    orbital, own = mass @ np.cross(position, velocity), spin.sum(axis=0)
    energy = 0.5 * float(mass @ np.einsum("ij,ij->i", velocity, velocity))
    difference = float(np.linalg.norm(momentum - casing.momentum))
    turning = float(np.linalg.norm(orbital + own - casing.angular_momentum))
    return BreakUpLedger(
        mass=total,
        casing_mass=casing.mass,
        mass_error=(total - casing.mass) / casing.mass,
        momentum=_triple(momentum),
        casing_momentum=_triple(casing.momentum),
        momentum_error=difference / casing.scale if casing.scale > 0.0 else 0.0,
        angular_momentum=_triple(orbital),
        spin=_triple(own),
        casing_angular_momentum=_triple(casing.angular_momentum),
        angular_momentum_error=turning / casing.angular_scale if casing.angular_scale > 0.0 else 0.0,
        energy=energy,
        casing_energy=casing.energy,
        energy_error=(energy - casing.energy) / casing.energy if casing.energy > 0.0 else 0.0,
        cell_energy=casing.cell_energy,
    )


def _triple(vector: NDArray[np.float64]) -> tuple[float, float, float]:
    return float(vector[0]), float(vector[1]), float(vector[2])
