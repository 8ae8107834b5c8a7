"""The explicit step of the axisymmetric burst: as in three dimensions, with all parts of a macro step in one call."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.contact.charge_contacts import slide_law
from burst_fenicsx.contact.forces import max_squared_phase
from burst_fenicsx.kernels.axisymmetric.step import RingSums, add_ring_forces, advance_rings
from burst_fenicsx.kernels.step.assembly import make_scratch
from burst_fenicsx.mechanics.solver import BurstSolver

if TYPE_CHECKING:
    from burst_fenicsx.axisymmetric.fields import RingFields
    from burst_fenicsx.axisymmetric.slide_line import LineInterface
    from burst_fenicsx.contact import ContactForces
    from burst_fenicsx.mechanics.detonation import LeakageParts
    from burst_fenicsx.mechanics.ledger import Ledger
    from burst_fenicsx.problem import BurstSettings

__all__ = ["RingSolver"]


class RingSolver(BurstSolver):
    """Steps the axisymmetric burst; parameters and attributes as for `BurstSolver`, and the slide `line`."""

    fields: RingFields
    contact: ContactForces

    def __init__(
        self,
        fields: RingFields,
        settings: BurstSettings,
        leakage: LeakageParts,
        ledger: Ledger,
        contact: ContactForces,
        line: LineInterface,
    ) -> None:
        self._line, self._contacts = line.line, line.contacts
        self._law = slide_law(settings.contact, max_squared_phase(settings.time_step), 1.0)
        given = np.zeros((len(fields.products), 2))
        self._sums = RingSums(np.zeros(5), given, np.zeros(3), np.zeros(3), contact.force)
        self._work = make_scratch(1)[0]
        super().__init__(fields, settings, leakage, ledger, contact=contact)

    def advance(self, step: float) -> None:
        """All parts of a macro step (s)."""
        begin = self.time
        whole = advance_rings(
            begin, step, self.time_step, self.free_step, self.subcycling.highest, self.subcycling.moving, *self._arrays
        )
        # With damping all cells take the macro step: the nodes have moved once, under the old forces.
        self.loads.accumulate_work(self.ledger, 0.5 * step)
        self.time = begin + step
        if not whole:
            self._take_sums()
            self.check_cells()
        self.leakage.update(self.fields.nodes.position, self.time)
        self.add_forces(step)

    def add_forces(self, step: float, min_level: int = 0) -> None:
        """Resultant at the new places of the nodes of cells of level `min_level` and higher, as in `BurstSolver`."""
        moving = int(self.subcycling.moving[min_level])
        add_ring_forces(step, self.free_step, self.time, min_level, moving, *self._arrays)
        self.loads.add_forces(self.time)
        self._take_sums()

    def _take_sums(self) -> None:
        """Hand what the kernel has summed to ledger and contact, and its limits to the checks."""
        sums, totals = self._sums, self._totals
        self.ledger.add(sums.energy[None], sums.released[None])
        sums.energy[:], sums.released[:] = 0.0, 0.0
        friction, work, depth = sums.contact.tolist()
        self.contact.friction += friction
        self.contact.work += work
        self.contact.penetrations.at_interface(depth, front_is_active=self.front_is_active)
        sums.contact[:] = 0.0
        self.stable_step = float(sums.limits[0])
        totals.stable_step[:], totals.smallest_volume[:] = sums.limits[0], sums.limits[1]
        totals.smallest[:] = int(sums.limits[2])

    @property
    def _arrays(self) -> tuple[object, ...]:
        """What both kernels take, in their order."""
        state = self.fields
        return (
            self._work,
            state.nodes,
            self.subcycling.motion,
            state.grid,
            state.blocks.schedule,
            state.solid,
            state.charge,
            state.rings,
            self.subcycling.contact_level,
            self._law,
            self._line,
            self._contacts,
            self._sums,
        )
