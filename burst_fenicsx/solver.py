"""The explicit step (Eqs. 1-3): updated Lagrangian, lumped mass, semi-implicit Euler."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np
from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.assembly import add_element_forces, make_scratch, move_nodes
from burst_fenicsx.kernels.state import Totals
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.contact import ContactForces
    from burst_fenicsx.detonation import LeakageParts
    from burst_fenicsx.fields import BurstFields
    from burst_fenicsx.initiation import ShockInitiations
    from burst_fenicsx.ledger import Ledger
    from burst_fenicsx.problem import BurstSettings

__all__ = ["BurstSolver", "Hold"]

# While a charge burns, a step lets no cell burn by more than this fraction, so that coarse cells are resolved too.
_BURN_PER_STEP = 0.25
# After the last cell has burnt out, the front is thrown back from the casing for about this long (s).
_REFLECTION = 10e-6
# The step may shrink at once but grows by this factor at most, so that one cell's relief does not jolt the rest.
_STEP_GROWTH = 1.05


class Hold:
    """Nodes that may not move along a direction, such as those of a symmetry plane.

    Parameters
    ----------
    nodes : (k,) local nodes. direction : (3,) unit vector.
    """

    def __init__(self, nodes: np.ndarray, direction: np.ndarray) -> None:
        self.nodes = np.asarray(nodes)
        self.direction = np.asarray(direction, dtype=float)

    def apply(self, force: np.ndarray) -> None:
        """Take the forces (nodes, 3) along the direction away."""
        held, (x, y, z) = force[self.nodes], self.direction
        # Component by component: a matrix product sums in an order of its own.
        along = x * held[:, 0] + y * held[:, 1] + z * held[:, 2]
        force[self.nodes] = held - along[:, None] * self.direction


class BurstSolver:
    """Steps the burst.

    Parameters
    ----------
    fields : the state.
    settings : how it is stepped.
    leakage : venting of the products.
    ledger : where the sums go.
    contact : bonds, colliding surfaces and planes.
    initiation : of charges by shock.
    holds : nodes that may not move along a direction.
    external : called with the time (s) and the forces (nodes, 3) in N, to which it adds external ones.

    Attributes
    ----------
    time, time_step, steps : simulated time (s), last step (s), steps done.
    stable_step, free_step : stable limit now (s); the last step (s) before it was cut to meet an output.
    """

    def __init__(
        self,
        fields: BurstFields,
        settings: BurstSettings,
        leakage: LeakageParts,
        ledger: Ledger,
        *,
        contact: ContactForces | None = None,
        initiation: ShockInitiations | None = None,
        holds: tuple[Hold, ...] = (),
        external: Callable[[float, np.ndarray], None] | None = None,
    ) -> None:
        self.fields = fields
        self.settings = settings
        self.leakage = leakage
        self.ledger = ledger
        self.contact = contact
        self.initiation = initiation
        self.holds = holds
        self.external = external
        self.time = 0.0
        self.time_step = 0.0
        self.steps = 0
        chunks = fields.blocks.schedule.chunk.size
        self._totals = Totals(
            np.zeros((chunks, 5)),
            np.zeros((chunks, len(fields.products), 2)),
            np.zeros(chunks),
            np.zeros(chunks, dtype=np.int32),
            np.zeros(chunks),
            np.zeros(chunks, dtype=np.int32),
        )
        self._scratch = make_scratch(numba.get_num_threads())
        self._external_force = np.zeros_like(fields.nodes.force) if external else None
        self._damping_force = np.zeros_like(fields.nodes.force) if settings.damping > 0.0 else None
        self.stable_step = np.inf
        self.free_step = 0.0
        self.set_burning_times()
        self.add_forces(0.0)

    @property
    def resultant(self) -> np.ndarray:
        """Resultant nodal force (nodes, 3) in N, Eq. 2."""
        return self.fields.nodes.force

    def step(self, until: float = np.inf) -> None:
        """Advance by one step, not beyond the time `until` (s).

        Raises
        ------
        NumericalStop
            If a cell is lost or the state is not a number any more.
        """
        step = self.choose_step(until)
        self.move_nodes(step)
        self.leakage.update(self.fields.nodes.position, self.time)
        self.add_forces(step)
        self.ledger.add(self._totals.energy, self._totals.given)
        self.check_cells()
        if self.initiation is not None and self.initiation.update(self.time, step):
            self.set_burning_times()

    def choose_step(self, until: float) -> float:
        """Size of the next step (s): the CFL fraction of the stable one, or the fixed one."""
        wanted = self.settings.time_step.fixed or self.settings.time_step.cfl * self.stable_step
        if self.settings.time_step.fixed is None and self.time < self._burnt_out:
            wanted = min(wanted, _BURN_PER_STEP / self._fastest_burn)
        if self.free_step > 0.0:
            wanted = min(wanted, _STEP_GROWTH * self.free_step)
        self.free_step = wanted
        left = until - self.time
        # Two equal steps rather than a full and a tiny one.
        return min(wanted, left if left <= wanted else max(0.5 * left, 1e-3 * wanted))

    def set_burning_times(self) -> None:
        """Find the largest burn rate (1/s) and the time by which every lit cell has burnt out (s); collective.

        To be called again when ignition times have changed.
        """
        charge = self.fields.charge
        lit = np.isfinite(charge.ignition_time) & (charge.burn_rate > 0.0)
        rate = float(charge.burn_rate[lit].max(initial=1e-300))
        end = float((charge.ignition_time[lit] + 1.0 / charge.burn_rate[lit]).max(initial=0.0))
        comm = self.fields.mesh.comm
        several = comm.size > 1
        self._fastest_burn = comm.allreduce(rate, op=MPI.MAX) if several else rate
        self._burnt_out = comm.allreduce(end, op=MPI.MAX) if several else end

    def move_nodes(self, step: float) -> None:
        """Velocities, then places (Eq. 3).

        The velocities belong to the middles of the steps, so they advance by half the last step and half this one:
        Eq. 3 where steps are equal, and of second order where they are not (Belytschko et al. 2000, box 6.1).
        """
        force = self.resultant
        nodes = self.fields.nodes
        kick = 0.5 * (self.time_step + step)
        move_nodes(kick, step, self.fields.inverse_mass, force, nodes.velocity, nodes.position)
        self._add_external_work(0.5 * step)
        self._add_damping_heat(0.5 * step)
        self.time += step
        self.time_step = step
        self.steps += 1

    def add_forces(self, step: float) -> None:
        """Resultant at the new places (Eq. 2): element forces (Eq. 1), contact, external ones and damping."""
        state = self.fields
        add_element_forces(
            step,
            self.time,
            self.settings.quadrature == "full",
            state.nodes,
            state.grid,
            state.blocks.schedule,
            state.solid,
            state.charge,
            self._totals,
            self._scratch,
        )
        comm = state.mesh.comm
        if comm.size > 1:
            compat.add_to_owners(state.force)
        if self.contact is not None:
            self.contact.add_forces(self.free_step, step, front_near=self.time < self._burnt_out + _REFLECTION)
        if comm.size > 1:
            compat.send_to_ghosts(state.force)
        if self._external_force is not None and self.external is not None:
            # After the sum over ranks: every rank gives its local nodes their whole external force.
            self._external_force[:] = 0.0
            self.external(self.time, self._external_force)
            state.nodes.force[:] += self._external_force
            self._add_external_work(0.5 * step)
        if self._damping_force is not None:
            self._damping_force[:] = -self.settings.damping * state.mass[:, None] * state.nodes.velocity
            state.nodes.force[:] += self._damping_force
            self._add_damping_heat(0.5 * step)
        for hold in self.holds:
            hold.apply(state.nodes.force)
        stable = float(self._totals.stable_step.min()) if self._totals.stable_step.size else np.inf
        if comm.size > 1:
            stable = comm.allreduce(stable, op=MPI.MIN)
        self.stable_step = stable

    def _add_external_work(self, half_step: float) -> None:
        """Book the work of the external forces over half a step (s), its first half with the old forces."""
        if self._external_force is not None:
            owned = self.fields.mesh.owned_nodes
            velocity = self.fields.nodes.velocity[:owned]
            self.ledger.external_work += half_step * float(np.sum(self._external_force[:owned] * velocity))

    def _add_damping_heat(self, half_step: float) -> None:
        """Book what the damping takes over half a step (s), its first half with the old forces; over all ranks."""
        if self._damping_force is not None:
            mesh = self.fields.mesh
            velocity = self.fields.nodes.velocity[: mesh.owned_nodes]
            heat = -half_step * float(np.sum(self._damping_force[: mesh.owned_nodes] * velocity))
            self.ledger.damping += mesh.comm.allreduce(heat) if mesh.comm.size > 1 else heat

    def check_cells(self) -> None:
        """Stop if a cell has turned inside out or anything is not a number."""
        smallest = self._totals.smallest_volume
        lost = int(np.argmin(smallest)) if smallest.size else -1
        message = ""
        if lost >= 0 and not smallest[lost] > 0.0:
            message = self.describe_cell(int(self._totals.smallest[lost]))
        if not self.stable_step > 0.0:
            message = message or "the stable step is no number"
        if self.fields.mesh.comm.size > 1:
            messages = [text for text in self.fields.mesh.comm.allgather(message) if text]
            message = messages[0] if messages else ""
        if message:
            raise NumericalStop(f"lost cell: {message}", self.time)

    def describe_cell(self, cell: int) -> str:
        """Where a local cell is, in words."""
        mesh = self.fields.mesh
        place = self.fields.nodes.position[mesh.dofmap[cell]].mean(axis=0) * 1e3
        return (
            f"cell {mesh.cell[cell]} of the {Part(int(mesh.part[cell])).name.lower()} of round {mesh.round[cell]}, "
            f"station {mesh.station[cell] * 1e3:.1f} mm from the nose, "
            f"now at ({place[0]:.1f}, {place[1]:.1f}, {place[2]:.1f}) mm, has turned inside out"
        )
