"""The explicit step (Eqs. 1-3): updated Lagrangian, lumped mass, semi-implicit Euler, local time stepping."""

from __future__ import annotations

from functools import cached_property
from typing import TYPE_CHECKING

import numba
import numpy as np
from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.errors import NumericalStop
from burst_fenicsx.kernels.state import Totals
from burst_fenicsx.kernels.step.assembly import FULL_QUADRATURE, ONE_POINT, add_element_forces, make_scratch, move_nodes
from burst_fenicsx.mechanics.burning_times import BurningTimes
from burst_fenicsx.mechanics.erosion import ElementErosion
from burst_fenicsx.mechanics.nodal_loads import NodalLoads
from burst_fenicsx.mechanics.subcycling import Subcycling
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.contact import ContactForces
    from burst_fenicsx.mechanics.detonation import LeakageParts
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.mechanics.initiation import ShockInitiations
    from burst_fenicsx.mechanics.ledger import Ledger
    from burst_fenicsx.mechanics.nodal_loads import Hold
    from burst_fenicsx.problem import BurstSettings

__all__ = ["BurstSolver"]

# While a charge burns, a step lets no cell burn by more than this fraction, so that coarse cells are resolved too.
_BURN_PER_STEP = 0.25
# The step may shrink at once but grows by this factor at most, so that one cell's relief does not jolt the rest.
_STEP_GROWTH = 1.05
# Levels are chosen again after so many macro steps, or when cells have got so thin that the longest
# step has to be cut below this share of what was chosen, but not sooner than after a few.
_STEPS_PER_CHOICE = 16
_FEWEST_STEPS = 4
_MIN_SHARE = 0.9
# Share of its stable step that a cell takes then. Below sin(pi/4) its fastest oscillation turns by less than a quarter
# in its own step and by less than a half in a neighbour's, which is twice as long: no resonance with its impulses.
_OWN_CFL = 0.68
# How long a cell keeps the step in which it burns: so many times what it takes to burn. Where compression burns it, a
# front may come sooner than is timed, by the square root of 27/32 (see `landau`).
_BEHIND_FRONT = 20.0
_EARLIEST = 0.9
# Contact's step, whose square its stiffness goes against, is this share of the first one, or that in which cells burn.
_CONTACT_SHARE = 0.7


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
    time, time_step, steps : simulated time (s), last step (s), steps done: the longest, at whose ends all cells meet.
    stable_step, free_step : stable limit of it now (s); the last one (s) before it was cut to meet an output.
    burning : how long cells burn. loads : external forces and damping.
    subcycling : the cells' own steps. chosen_at, choose_again : times (s) when they were and are to be chosen.
    contact_step : bound on contact's step (s). cell_steps : steps that this rank's cells have made.
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
        self.time = 0.0
        self.time_step = 0.0
        self.steps = 0
        chunks = fields.blocks.schedule.chunk.size
        self._totals = Totals(
            np.zeros((chunks, 5)),
            np.zeros((chunks, len(fields.products), 2)),
            np.zeros(chunks),
            np.zeros(chunks),
            np.zeros(chunks, dtype=np.int32),
        )
        # For every thread that there may be: how many step is settled again at every call.
        self._scratch = make_scratch(numba.config.NUMBA_NUM_THREADS)
        self.burning = BurningTimes(fields)
        self.loads = NodalLoads(fields, settings.damping, external)
        self.stable_step = np.inf
        self.free_step = 0.0
        self.subcycling = Subcycling(fields, contact.touched if contact is not None and contact.exists else None)
        self.choose_again = 0.0
        self.chosen_at = 0.0
        self.cell_steps = 0
        self.add_forces(0.0)
        self.contact_step = min(
            _CONTACT_SHARE * settings.time_step.cfl * self.stable_step, _BURN_PER_STEP / self.burning.fastest
        )

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
        if self.steps % _STEPS_PER_CHOICE == 0:
            self.erode_metal()
        step = self.choose_step(until)
        self.advance(step)
        self.time_step = step
        self.steps += 1
        self.cell_steps += self.subcycling.cell_steps
        self.loads.accumulate_work(self.ledger, 0.5 * step)
        self.check_cells()
        if self.initiation is not None and self.initiation.update(self.time, step):
            self.burning.update()
            self.choose_again = self.time

    def advance(self, step: float) -> None:
        """All parts of a macro step (s): nodes move, venting is found at its end, forces follow."""
        begin, parts = self.time, 2**self.subcycling.highest
        min_level, velocity_step = 0, 0.5 * (self.time_step + step)
        for part in range(parts):
            self.move_nodes(velocity_step, step, part, min_level)
            if part == 0:
                self.loads.accumulate_work(self.ledger, 0.5 * step)
            self.time = begin + step * ((part + 1) / parts)
            # Cells of the shortest steps end one with every part, those of twice the step with every second one, ...
            min_level = self.subcycling.highest - _halvings(part + 1)
            if min_level == 0:
                self.leakage.update(self.fields.nodes.position, self.time)
            self.add_forces(step, min_level)
            self.ledger.add(self._totals.energy, self._totals.released)
            velocity_step = step

    def choose_step(self, until: float) -> float:
        """Size of the next (longest) step (s): the CFL fraction of the stable one, or the fixed one."""
        wanted = self.settings.time_step.fixed or self.settings.time_step.cfl * self.stable_step
        if self.subcycles:
            chosen = self.subcycling.step
            waited = self.time > self.chosen_at + _FEWEST_STEPS * chosen or wanted < 0.5 * chosen
            early = wanted < _MIN_SHARE * chosen and waited
            if self.time >= self.choose_again or early:
                self.choose_levels()
                wanted, chosen = self.settings.time_step.cfl * self.stable_step, self.subcycling.step
            wanted = min(wanted, chosen)
        elif self.settings.time_step.fixed is None and self.time < self.burning.end:
            wanted = min(wanted, _BURN_PER_STEP / self.burning.fastest)
        if self.free_step > 0.0:
            wanted = min(wanted, _STEP_GROWTH * self.free_step)
        self.free_step = wanted
        left = until - self.time
        # Two equal steps rather than a full and a tiny one.
        return min(wanted, left if left <= wanted else max(0.5 * left, 1e-3 * wanted))

    @cached_property
    def _erosion(self) -> ElementErosion:
        return ElementErosion(self.fields)

    def erode_metal(self) -> None:
        """Erode cells of casings that are no continuum any more; contact leaves their faces; collective."""
        self._erosion.erode()
        if self.contact is not None:
            self.contact.drop_faces(self.fields.eroded_metal)

    def erode_folded_metal(self) -> None:
        """Erode, at the end of the burst, cells without strength that are folded, compressed or not."""
        self._erosion.erode_at_end()

    @property
    def front_is_active(self) -> bool:
        """Whether a detonation front runs or is being reflected from the casing."""
        return self.burning.front_is_active(self.time)

    @property
    def subcycles(self) -> bool:
        """Whether time stepping is local; not with forces that are taken at the macro step's ends only."""
        choice = self.settings.time_step
        return choice.subcycling and choice.fixed is None and not self.loads.any

    def choose_levels(self) -> None:
        """Choose the steps of the cells again.

        Where they change, the velocities are brought to the time of the places, and the forces are made again with the
        cells' new shares.
        """
        state, cycles, cfl = self.fields, self.subcycling, self.settings.time_step.cfl
        old = state.blocks.cell_levels
        old_level, old_step = cycles.contact_level, cycles.step
        stable, charge = state.blocks.by_cell(state.grid.stable), state.charge
        # A front and what follows close behind it are left to cells of one step.
        with np.errstate(divide="ignore"):
            passed = charge.ignition_time + _BEHIND_FRONT / charge.burn_rate
        burning = np.flatnonzero(np.isfinite(passed) & (passed > self.time))

        def allowed(step: float, share: float = min(_OWN_CFL, cfl)) -> np.ndarray:
            """Steps (s) that cells may take till the next choice, if the longest is `step`: a share of the stable."""
            soon = burning[_EARLIEST * charge.ignition_time[burning] < self.time + (_STEPS_PER_CHOICE + 2) * step]
            found = share * stable
            found[soon] = np.minimum(found[soon], _BURN_PER_STEP / charge.burn_rate[soon])
            return found

        contact = self.contact if self.contact is not None and self.contact.exists else None
        # Together, cells may take more of their stable steps than where steps differ.
        together = self._minimum(allowed(cfl * self._minimum(stable), cfl))
        level = cycles.choose(allowed, together, self.contact_step if contact is not None else None)
        self.choose_again = self.time + _STEPS_PER_CHOICE * cycles.step
        self.chosen_at = self.time
        state.grid = state.grid._replace(longest=cycles.step)
        changed = cycles.contact_level != old_level or old_step == 0.0 or not np.array_equal(level, old)
        if not self._somewhere(changed):
            return
        self.move_nodes(0.5 * self.time_step, 0.0, 0, 0)
        self.time_step = 0.0
        cycles.set_levels(level)
        if contact is not None:
            # The step of contact goes on smoothly.
            self.free_step *= 2.0 ** (cycles.contact_level - old_level)
            contact.set_level(cycles.contact_level)
        else:
            self.free_step = 0.0
        self.add_forces(0.0)

    def _minimum(self, values: np.ndarray) -> float:
        """Minimum of all ranks' values; collective."""
        minimum, comm = float(values.min(initial=np.inf)), self.fields.mesh.comm
        return float(comm.allreduce(minimum, op=MPI.MIN)) if comm.size > 1 else minimum

    def _somewhere(self, holds: bool) -> bool:
        """Whether something holds on any rank; collective."""
        comm = self.fields.mesh.comm
        return bool(comm.allreduce(holds, op=MPI.LOR)) if comm.size > 1 else holds

    def move_nodes(self, velocity_step: float, step: float, part: int, min_level: int) -> None:
        """Velocities, then places (Eq. 3), of the nodes of cells of level `min_level` and higher.

        Velocities belong to the midpoints of the steps, so they advance by `velocity_step` (s), half the last step
        and half this one: Eq. 3 where steps are equal, and of second order where they are not (Belytschko et al. 2000,
        box 6.1). `step` is the macro step (s), of which `part` of the shortest have gone by.
        """
        nodes, cycles = self.fields.nodes, self.subcycling
        move_nodes(
            cycles.moving[min_level],
            *cycles.motion,
            velocity_step,
            step,
            part,
            cycles.highest,
            nodes.force,
            nodes.velocity,
            nodes.position,
            nodes.mean,
        )

    def add_forces(self, step: float, min_level: int = 0) -> None:
        """Resultant at the new places (Eq. 2) of the nodes of cells of level `min_level` and higher.

        Element forces (Eq. 1), contact, external ones and damping, each with the share that its own step has in the
        longest one, `step` (s).
        """
        state, cycles = self.fields, self.subcycling
        add_element_forces(
            numba.get_num_threads(),
            step,
            self.time,
            min_level,
            FULL_QUADRATURE if self.settings.quadrature == "full" else ONE_POINT,
            state.nodes,
            cycles.motion,
            cycles.moving[min_level],
            state.grid,
            state.blocks.schedule,
            state.solid,
            state.charge,
            self._totals,
            self._scratch,
        )
        comm = state.mesh.comm
        if comm.size > 1:
            # Nodes that do not take part hold forces that have been used; those are cleared before they count again.
            compat.add_to_owners(state.functions["force"])
        if self.contact is not None and cycles.contact_level >= min_level:
            share = 1.0 / 2**cycles.contact_level
            self.contact.add_forces(share * self.free_step, share * step, front_is_active=self.front_is_active)
        if comm.size > 1:
            compat.send_to_ghosts(state.functions["force"])
        self.loads.add_forces(self.time)  # after the sum over ranks
        for hold in self.holds:
            hold.apply(state.nodes.force)
        if min_level == 0:
            stable = float(self._totals.stable_step.min()) if self._totals.stable_step.size else np.inf
            self.stable_step = comm.allreduce(stable, op=MPI.MIN) if comm.size > 1 else stable

    def check_cells(self) -> None:
        """Stop if a cell has turned inside out or anything is not a number."""
        smallest = self._totals.smallest_volume
        lost = int(np.argmin(smallest)) if smallest.size else -1
        message = ""
        if lost >= 0 and not smallest[lost] > 0.0:
            message = self.describe_cell(int(self._totals.smallest[lost]))
        if not self.stable_step > 0.0:
            message = message or "the stable step is NaN"
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


def _halvings(number: int) -> int:
    """How often a number divides by two."""
    return (number & -number).bit_length() - 1
