"""The explicit step (Eqs. 1-3): updated Lagrangian, lumped mass, semi-implicit Euler, local time stepping."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np

from burst_fenicsx import compat
from burst_fenicsx.kernels.constants import EROSION_INTERVAL
from burst_fenicsx.kernels.step.assembly import RINGS, Interval, advance_halves
from burst_fenicsx.kernels.vectors.rows import hold_rows
from burst_fenicsx.mechanics.erosion import check_cells, erode
from burst_fenicsx.mechanics.nodal_loads import NodalLoads, held_nodes
from burst_fenicsx.mechanics.step_control import BurningTimes, StepControl
from burst_fenicsx.mechanics.subcycling import Subcycling

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.contact import ContactForces
    from burst_fenicsx.mechanics.detonation import AxialSlices
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.mechanics.initiation import ShockInitiations
    from burst_fenicsx.mechanics.ledger import Ledger
    from burst_fenicsx.mechanics.nodal_loads import NodalConstraint
    from burst_fenicsx.problem import BurstSettings


class BurstSolver:
    """Steps the burst, in three dimensions or in the meridian.

    Parameters
    ----------
    fields : the state.
    settings : how it is stepped.
    leakage : venting of the products.
    ledger : where the sums go.
    contact : bonds, colliding surfaces and planes.
    initiation : of charges by shock.
    constraints : nodes that may not move along a direction.
    external : called with the time (s) and the forces (nodes, 3) in N, to which it adds external ones.

    Attributes
    ----------
    time, time_step, steps : simulated time (s), last step (s), steps done: macro steps, at whose ends all cells meet.
    cell_steps : steps that this rank's cells have made.
    levels, control : the cells' own steps, and what chooses them and the macro step.
    burning : how long cells burn. loads : external forces and damping.
    """

    def __init__(
        self,
        fields: BurstFields,
        settings: BurstSettings,
        leakage: AxialSlices,
        ledger: Ledger,
        *,
        contact: ContactForces | None = None,
        initiation: ShockInitiations | None = None,
        constraints: tuple[NodalConstraint, ...] = (),
        external: Callable[[float, np.ndarray], None] | None = None,
    ) -> None:
        self.fields = fields
        self.leakage = leakage
        self.ledger = ledger
        self.contact = contact
        self.initiation = initiation
        self.constraints = constraints
        self.time, self.time_step = 0.0, 0.0
        self.steps, self.cell_steps = 0, 0
        self.burning = BurningTimes(fields)
        self.loads = NodalLoads(fields, settings.damping, external)
        self.levels = Subcycling(fields, contact)
        self._in_substeps = contact is not None and contact.acts_in_substeps
        self.control = StepControl(fields, settings.time_step, self.levels, self.burning, self.loads)
        self.add_forces(0.0)

    def step(self, until: float = np.inf, before: Callable[[float], None] | None = None) -> None:
        """Advance by one macro step, not beyond the time `until` (s).

        `before` is called with the time (s) to which the step leads, while the state is still the old one.

        Raises
        ------
        NumericalStop
            If a cell is lost or the state is not a number any more.
        """
        if self.steps == 0 or self.time // EROSION_INTERVAL > (self.time - self.time_step) // EROSION_INTERVAL:
            self.erode_metal()
        if self.control.levels_are_due(self.time):
            self.choose_levels()
        step = self.control.next_step(self.time, until)
        if before is not None:
            before(self.time + step)
        self.advance(step)
        self.time_step = step
        self.steps += 1
        self.cell_steps += self.levels.cell_steps
        self.loads.accumulate_work(self.ledger, 0.5 * step)
        self.check_cells()
        if self.initiation is not None and self.initiation.update(self.time, step):
            self.burning.update()
            self.control.choose_again = self.time

    def advance(self, step: float) -> None:
        """All substeps of a macro step (s): nodes move, products vent at its end, forces follow.

        Those between two at which contact acts, or ranks sum forces, are made by one call of the kernels.
        """
        begin, substeps = self.time, 2**self.levels.highest
        several, of_contact = self.fields.mesh.comm.size > 1, 0 if self._in_substeps else self.levels.contact_level
        at_once = 1 if several else 2 ** (self.levels.highest - of_contact)
        velocity_step = 0.5 * (self.time_step + step)
        self.fields.totals.clear()
        for substep in range(at_once, substeps + 1, at_once):
            self._advance_halves(Interval(2 * (substep - at_once), 2 * substep - 1, begin, step, step, velocity_step))
            if substep == at_once:
                self.loads.accumulate_work(self.ledger, 0.5 * step)
            self.time = begin + step * (substep / substeps)
            if substep == substeps:
                self.leakage.update(self.fields.nodes.position)
            self._add_forces(step, substep)
        self.ledger.add(self.fields.totals.energy, self.fields.totals.released)

    def add_forces(self, step: float) -> None:
        """Resultant at the present positions (Eq. 2) of all nodes, at the end of a macro step (s); tallies the work."""
        self.fields.totals.clear()
        self.fields.nodes.force[:] = 0.0
        self._add_forces(step, 2**self.levels.highest)

    def _add_forces(self, step: float, substep: int) -> None:
        """Resultant at the new positions (Eq. 2) of the nodes of cells that end a step with a substep.

        Element forces (Eq. 1), contact (Eqs. 12-18), external ones and damping, each with the fraction that its own
        step is of the macro step `step` (s).
        """
        state, levels, several = self.fields, self.levels, self.fields.mesh.comm.size > 1
        self._advance_halves(Interval(2 * substep - 1, 2 * substep, self.time, 0.0, step, 0.0))
        if several:
            compat.add_ghosts(state.functions["force"].x)
        contact_is_due = substep % 2 ** (levels.highest - levels.contact_level) == 0
        if self.contact is not None and not self._in_substeps and contact_is_due:
            fraction = 1.0 / 2**levels.contact_level
            active = self.time < self.burning.front_until
            self.contact.add_forces(fraction * self.control.uncut_step, fraction * step, front_is_active=active)
        if several:
            state.functions["force"].x.scatter_forward()
        self.loads.add_forces(self.time)  # after the sum over ranks
        hold_rows(state.nodes.force, *held_nodes(self.constraints))
        if substep == 2**levels.highest:
            self.control.take_stable_step(self.fields.totals.stable_step)

    def _advance_halves(self, interval: Interval) -> None:
        state, level, along, threads = self.fields, self.levels.contact_level, None, numba.get_num_threads()
        if self.contact is not None and self._in_substeps:
            along = self.contact.in_substeps(self.control.uncut_step, interval.step, level, self.burning.front_until)
        threads = 1 if state.kind == RINGS else threads  # their forces are not rounded
        held = held_nodes(self.constraints)
        advance_halves(interval, state.kind, state.kernels, threads, state.cells, self.levels.motion, held, along)
        if self.contact is not None and self._in_substeps:
            self.contact.take_sums()

    def choose_levels(self) -> None:
        """Choose the cells' steps again; collective.

        Where they change, the velocities are brought to the time of the positions, and the forces are made again with
        the cells' new fractions.
        """
        level = self.control.choose_levels(self.time)
        if level is None:
            return
        self.bring_velocities()
        self.levels.set_levels(level)
        if self.contact is not None:
            self.contact.set_level(self.levels.contact_level)
        self.add_forces(0.0)
        self.ledger.add(self.fields.totals.energy, self.fields.totals.released)  # of cells that have just been eroded

    def bring_velocities(self) -> None:
        """Bring the velocities from half a step before to the time of the positions."""
        self._advance_halves(Interval(0, 1, self.time, 0.0, 0.0, 0.5 * self.time_step))
        self.time_step = 0.0

    def erode_metal(self) -> None:
        """Erode cells of casings that are no continuum any more; contact leaves their faces; collective."""
        erode(self.fields)
        if self.contact is not None:
            self.contact.drop_faces(self.fields.eroded_metal)

    def check_cells(self) -> None:
        """Stop if a cell has turned inside out or anything is not a number; collective."""
        check_cells(self.fields, self.fields.totals, self.control.stable_step, self.time)
