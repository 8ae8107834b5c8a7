"""Energy, momentum and mass of the burst, and the bounds that stop it."""

from __future__ import annotations

from dataclasses import dataclass, field, fields
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.constants import MIN_CONTACT_WORK, MIN_WORK, MIN_WORK_FOR_A_STOP

if TYPE_CHECKING:
    from mpi4py import MPI

    from burst_fenicsx.contact import ContactForces
    from burst_fenicsx.mechanics.fields import BurstFields


@dataclass
class Entry:
    """The ledger at one time. Energies in J, momenta in kg m/s."""

    time: float
    time_step: float
    kinetic: float
    kinetic_casing: float
    strain: float
    plastic: float
    viscous: float
    hourglass: float
    contact: float
    contact_gain: float
    damping: float
    external_work: float
    products_work: float
    products_viscous: float
    products_energy_left: float
    energy_error: float
    contact_error: float
    momentum_error: float
    mean_casing_speed: float
    outer_diameter: float


@dataclass
class Ledger:
    """Running sums of what the kernels report, and the entries taken from time to time.

    The balance is kinetic + strain + plastic + viscous + hourglass + contact + damping = work of the charge + work of
    external forces + what contact has made. Contact's entry is what its springs hold and friction has turned to heat;
    energy that contact makes or loses, `contact_gain`, is measured by its forces and the motion of the nodes (see
    `ContactForces.gain`) and is an error of its own beside that of the balance, so that neither can hide the other.
    Both are taken relative to the work, or to `min_work` (contact's: ten times that) while next to nothing is done.
    The entries are the same to the last bit on any number of ranks (`DistributedMesh.cell_sums`).

    Attributes
    ----------
    energy_tolerance : an error above this, of the balance or of contact alone, stops the run, once it is above this
        too as a share of `MIN_WORK_FOR_A_STOP`.
    min_work : J, `MIN_WORK` of the chemical energy.
    sums : (5,) J: plastic, viscous, hourglass, work of the charge, its own viscous heat, of this rank.
    released : (rounds, 2) J: work and own viscous heat of each round's charge, of this rank.
    chemical_energies : (rounds,) J, of each round's charge.
    kinetic_casings : (rounds,) J, of each round's casing at the last entry.
    balanced : (k, 3) unit vectors at right angles to each other, along which the momentum of the images balances that
        of the computed part: there nothing is left to check.
    """

    energy_tolerance: float
    min_work: float
    chemical_energies: np.ndarray
    comm: MPI.Comm
    sums: np.ndarray = field(default_factory=lambda: np.zeros(5))
    released: np.ndarray = field(init=False)
    kinetic_casings: np.ndarray = field(init=False)
    external_work: float = 0.0  # J, of all ranks, on rank 0
    damping: float = 0.0
    balanced: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    entries: list[Entry] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Start every round's sums at nothing."""
        self.released = np.zeros((len(self.chemical_energies), 2))
        self.kinetic_casings = np.zeros(len(self.chemical_energies))

    @classmethod
    def at_rest(cls, state: BurstFields, energy_tolerance: float, balanced: np.ndarray) -> Ledger:
        """Begin the ledger of a burst whose charges have all their chemical energy; collective."""
        per_mass = np.array([products.energy / products.density for products in state.products])
        chemical = state.sums_by_charge([state.cell_mass[cells] for cells in state.charge_cells]) * per_mass
        return cls(energy_tolerance, MIN_WORK * float(chemical.sum()), chemical, state.mesh.comm, balanced=balanced)

    def add(self, chunk_energies: np.ndarray, chunk_released: np.ndarray) -> None:
        """Add the sums of one step, chunk after chunk: (chunks, 5) and (chunks, rounds, 2) in J."""
        self.sums += chunk_energies.sum(axis=0)
        self.released += chunk_released.sum(axis=0)

    def record(
        self,
        fields_now: BurstFields,
        time: float,
        step: float,
        diameter: float,
        contact: ContactForces | None = None,
    ) -> Entry:
        """Take the balance at `time` (s).

        Parameters
        ----------
        fields_now : the state. step : the last step (s).
        diameter : outer diameter (m), written along.
        contact : what takes energy, and momentum where there are planes.

        Raises
        ------
        NumericalStop
            If the energy balance is open, or contact has made or lost energy, by more than the tolerance.
        """
        # At the time of the positions, half a step after that of the velocities.
        kinetic, *momenta, size = fields_now.node_sums(0.5 * step)
        momentum = np.where(fields_now.element.momentum_is_conserved, momenta, 0.0)
        if contact is not None:
            momentum -= contact.impulse
        momentum -= self.balanced.T @ (self.balanced @ momentum)
        strain, mass, weighted, *of_casings = fields_now.solid_sums(0.5 * step)
        of_contact = (contact.energy, contact.gain) if contact is not None else (0.0, 0.0)
        local = np.array([*self.sums, self.external_work, *of_contact])
        total = self.comm.allreduce(local) if self.comm.size > 1 else local
        plastic, viscous, hourglass, work, heat, external = total[:6]
        in_contact, gain, left = float(total[6]), float(total[7]), _energies_left(fields_now).sum()
        stored = kinetic + strain + plastic + viscous + hourglass + in_contact + self.damping
        supplied = work + external
        scale = max(abs(supplied), self.min_work)
        entry = Entry(
            time=time,
            time_step=step,
            kinetic=float(kinetic),
            kinetic_casing=float(np.sum(of_casings)),
            strain=float(strain),
            plastic=float(plastic),
            viscous=float(viscous),
            hourglass=float(hourglass),
            contact=in_contact,
            contact_gain=gain,
            damping=self.damping,
            external_work=float(external),
            products_work=float(work),
            products_viscous=float(heat),
            products_energy_left=float(left),
            energy_error=float(abs(stored - gain - supplied) / scale),
            contact_error=abs(gain) / max(abs(supplied), MIN_CONTACT_WORK * self.min_work),
            momentum_error=float(np.linalg.norm(momentum) / size) if size > 0.0 else 0.0,
            mean_casing_speed=float(weighted / mass) if mass > 0.0 else 0.0,
            outer_diameter=diameter,
        )
        self.entries.append(entry)
        self.kinetic_casings = np.array(of_casings)
        enough = MIN_WORK_FOR_A_STOP * self.chemical_energies.max(initial=0.0)
        if not abs(stored - gain - supplied) / max(scale, enough) <= self.energy_tolerance:
            raise NumericalStop(
                f"the energy ledger is open by {100 * entry.energy_error:.6g} % of the work done "
                f"(allowed {100 * self.energy_tolerance:.6g} %): the cells hold {stored - gain:.6g} J, "
                f"the charge gave {supplied:.6g} J",
                time,
            )
        if not min(entry.contact_error, abs(gain) / max(scale, enough)) <= self.energy_tolerance:
            raise NumericalStop(
                f"contact has {'made' if gain > 0.0 else 'lost'} {100 * entry.contact_error:.6g} % of the work done "
                f"(allowed {100 * self.energy_tolerance:.6g} %): the work of its forces, its springs and friction "
                f"add up to {gain:.6g} J",
                time,
            )
        return entry

    def products_balances(self, fields_now: BurstFields) -> np.ndarray:
        """Work released by each round's products and remaining energy over its chemical energy (rounds,); collective.

        1 closes it; a charge that was never initiated gives a little less, the work done on it.

        What their own artificial viscosity turns to heat is not released: at the front it does the part of the
        compression that the pressure, which lies below the Rayleigh line there, does not.
        """
        released = self.released[:, 0] - self.released[:, 1]
        total = _energies_left(fields_now) + (self.comm.allreduce(released) if self.comm.size > 1 else released)
        return np.divide(total, self.chemical_energies, where=self.chemical_energies > 0.0, out=np.zeros_like(total))

    def columns(self) -> dict[str, np.ndarray]:
        """The entries as arrays of equal length, by name."""
        return {item.name: np.array([getattr(entry, item.name) for entry in self.entries]) for item in fields(Entry)}


def _energies_left(state: BurstFields) -> np.ndarray:
    """Work that each round's gas can still do (rounds,) in J, with the unreacted chemical energy; collective.

    That of an eroded cell is lost.
    """
    energies = []
    for own, products in zip(state.charge_cells, state.products, strict=True):
        start = state.cell_mass[own] / products.density
        burnt = state.charge.burn_fraction[own]
        volume = state.grid.volume[state.blocks.slot_of_cell[own]] / start
        left = products.remaining_work(volume, state.charge.energy[own])
        left = np.where(burnt > 0.0, burnt * left + (1.0 - burnt) * products.energy, products.energy)
        energies.append(np.where(state.eroded[own], 0.0, start * left))
    return state.sums_by_charge(energies)
