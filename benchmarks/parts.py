"""A run's solid cells or its charge cells alone, on the run's own arrays."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.kernels.state import Schedule
    from burst_fenicsx.simulation import Simulation

__all__ = ["count", "forces_of_part", "only"]

_SMALL = 1e-3  # of a step, as in `state.forces_alone`


def count(run: Simulation, *, charge: bool) -> int:
    """Cells of the charge, or all others."""
    return int(((run.fields.mesh.part == Part.CHARGE) == charge).sum())


def forces_of_part(run: Simulation, *, charge: bool) -> Callable[[], None]:
    """A function that computes the element forces of the charge alone, or of all other cells alone.

    To be called while `state.forces_alone` holds, which puts the right forces back when it ends.
    """
    fields, solver = run.fields, run.solver
    whole = fields.blocks
    part = replace(whole, schedule=only(whole.schedule, charge=charge))
    step = _SMALL * solver.time_step

    def forces() -> None:
        fields.blocks = part
        try:
            solver.add_forces(step)
        finally:
            fields.blocks = whole

    return forces


def only(schedule: Schedule, *, charge: bool) -> Schedule:
    """The schedule with no block of the other kind in any chunk."""
    active = schedule.active.copy()
    active[:, :, 0 if charge else 1] = 0
    return schedule._replace(active=active)
