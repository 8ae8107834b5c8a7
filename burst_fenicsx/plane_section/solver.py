"""The explicit step of a section: the cells and slide lines of the axisymmetric burst, and contact of casings."""

from __future__ import annotations

from typing import TYPE_CHECKING

from burst_fenicsx.axisymmetric.solver import RingSolver
from burst_fenicsx.mechanics.solver import BurstSolver

if TYPE_CHECKING:
    from burst_fenicsx.plane_section.contact import SectionContact

__all__ = ["SectionSolver"]


class SectionSolver(RingSolver):
    """Steps a section; parameters and attributes as for `BurstSolver`."""

    contact: SectionContact

    def choose_step(self, until: float) -> float:
        """As in `BurstSolver`; from before the casings meet on, contact keeps to its own step."""
        near = self.contact.near
        if near and not self.subcycling.steady_contact:
            self.subcycling.steady_contact = True
            self.choose_again = self.time
        return super().choose_step(until)

    def advance(self, step: float) -> None:
        """All parts of a longest step (s), as in three dimensions: casings may meet in each."""
        BurstSolver.advance(self, step)

    def add_forces(self, step: float, min_level: int = 0) -> None:
        """Resultant at the new places of the nodes of cells of level `min_level` and higher, as in `BurstSolver`."""
        stable = self.stable_step
        super().add_forces(step, min_level)
        if not self.stable_step > 0.0 or not self._totals.smallest_volume.min() > 0.0:
            self.check_cells()
        if min_level > 0:
            self.stable_step = stable  # cells of some levels alone
        if self.subcycling.contact_level >= min_level:
            share = 1.0 / 2**self.subcycling.contact_level
            self.contact.add_forces(share * self.free_step, share * step, front_near=self.front_near)
