"""The explicit step (Eqs. 1-3): updated Lagrangian, lumped mass, semi-implicit Euler, local time stepping."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numba
import numpy as np

from burst_fenicsx import compat
from burst_fenicsx.kernels.constants import STEPS_PER_CHOICE
from burst_fenicsx.kernels.state import Totals
from burst_fenicsx.kernels.step.assembly import add_element_forces, make_scratch
from burst_fenicsx.mechanics.erosion import check_cells, erode
from burst_fenicsx.mechanics.nodal_loads import NodalLoads
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

__all__ = ["BurstSolver"]


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
        self._totals = Totals.of_chunks(fields.blocks.schedule.chunk.size, len(fields.products))
        # For every thread that there may be: how many step is settled again at every call.
        self._scratch = make_scratch(numba.config.NUMBA_NUM_THREADS)
        self.burning = BurningTimes(fields)
        self.loads = NodalLoads(fields, settings.damping, external)
        self.levels = Subcycling(fields, contact)
        self.control = StepControl(fields, settings.time_step, self.levels, self.burning, self.loads)
        self.add_forces(0.0)

    def step(self, until: float = np.inf) -> None:
        """Advance by one macro step, not beyond the time `until` (s).

        Raises
        ------
        NumericalStop
            If a cell is lost or the state is not a number any more.
        """
        if self.steps % STEPS_PER_CHOICE == 0:
            self.erode_metal()
        if self.control.levels_are_due(self.time):
            self.choose_levels()
        step = self.control.next_step(self.time, until)
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
        """All substeps of a macro step (s): nodes move, products vent at its end, forces follow."""
        begin, substeps = self.time, 2**self.levels.highest
        min_level, velocity_step = 0, 0.5 * (self.time_step + step)
        for substep in range(substeps):
            self.levels.move_nodes(velocity_step, step, substep, min_level)
            if substep == 0:
                self.loads.accumulate_work(self.ledger, 0.5 * step)
            self.time = begin + step * ((substep + 1) / substeps)
            # Cells of the shortest steps end one with every substep, those of twice the step with every second, ...
            min_level = self.levels.highest - _halvings(substep + 1)
            if min_level == 0:
                self.leakage.update(self.fields.nodes.position)
            self.add_forces(step, min_level)
            self.ledger.add(self._totals.energy, self._totals.released)
            velocity_step = step

    def add_forces(self, step: float, min_level: int = 0) -> None:
        """Resultant at the new positions (Eq. 2) of the nodes of cells of level `min_level` and higher.

        Element forces (Eq. 1), contact (Eqs. 12-18), external ones and damping, each with the fraction that its own
        step is of the macro step `step` (s).
        """
        state, levels, several = self.fields, self.levels, self.fields.mesh.comm.size > 1
        add_element_forces(
            numba.get_num_threads(),
            step,
            self.time,
            min_level,
            state.kind,
            state.nodes,
            levels.motion,
            levels.moving[min_level],
            state.grid,
            state.blocks.schedule,
            state.solid,
            state.charge,
            state.rings,
            self._totals,
            self._scratch,
        )
        if several:
            # Nodes that do not take part hold forces that have been used; those are cleared before they count again.
            compat.add_ghosts(state.functions["force"].x)
        if self.contact is not None and levels.contact_level >= min_level:
            fraction = 1.0 / 2**levels.contact_level
            active = self.burning.front_is_active(self.time)
            self.contact.add_forces(fraction * self.control.uncut_step, fraction * step, front_is_active=active)
        if several:
            state.functions["force"].x.scatter_forward()
        self.loads.add_forces(self.time)  # after the sum over ranks
        for constraint in self.constraints:
            constraint.apply(state.nodes.force)
        if min_level == 0:
            self.control.take_stable_step(self._totals.stable_step)

    def choose_levels(self) -> None:
        """Choose the cells' steps again; collective.

        Where they change, the velocities are brought to the time of the positions, and the forces are made again with
        the cells' new fractions.
        """
        level = self.control.choose_levels(self.time)
        if level is None:
            return
        self.levels.move_nodes(0.5 * self.time_step, 0.0, 0, 0)
        self.time_step = 0.0
        self.levels.set_levels(level)
        if self.contact is not None:
            self.contact.set_level(self.levels.contact_level)
        self.add_forces(0.0)
        self.ledger.add(self._totals.energy, self._totals.released)  # of cells that have just been eroded

    def erode_metal(self) -> None:
        """Erode cells of casings that are no continuum any more; contact leaves their faces; collective."""
        erode(self.fields)
        if self.contact is not None:
            self.contact.drop_faces(self.fields.eroded_metal)

    def check_cells(self) -> None:
        """Stop if a cell has turned inside out or anything is not a number; collective."""
        check_cells(self.fields, self._totals, self.control.stable_step, self.time)


def _halvings(number: int) -> int:
    """How often a number divides by two."""
    return (number & -number).bit_length() - 1
