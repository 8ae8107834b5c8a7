"""A run's solid cells or its charge cells alone, on the run's own arrays."""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.problem import Part
from burst_fenicsx.solver import BurstSolver

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.kernels.state import Schedule
    from burst_fenicsx.simulation import Simulation

__all__ = ["count", "forces_of_part"]

_SMALL = 1e-3  # of a step, as in `state.forces_alone`


def count(run: Simulation, *, charge: bool) -> int:
    """Cells of the charge, or all others."""
    return int(((run.fields.mesh.part == Part.CHARGE) == charge).sum())


def forces_of_part(run: Simulation, *, charge: bool) -> Callable[[], None]:
    """A function that computes the element forces of the charge alone, or of all other cells alone.

    It leaves those forces in the run; `state.forces_alone` puts the right ones back when it ends.
    """
    blocks = replace(run.fields.blocks, schedule=only(run.fields.blocks.schedule, charge=charge))
    solver = BurstSolver(replace(run.fields, blocks=blocks), run.settings, run.leakage, run.ledger)
    solver.time = run.solver.time
    step = _SMALL * run.solver.time_step
    return lambda: solver.add_forces(step)


def only(schedule: Schedule, *, charge: bool) -> Schedule:
    """The schedule with every chunk cut in two, solid blocks and charge blocks, and one kind of halves left out.

    The list of chunks keeps all halves, so that sums over chunks have a place for each; the colours name one kind.
    """
    kept, left_out = 2 * schedule.chunk + charge, 2 * schedule.chunk + (not charge)
    first = np.empty(2 * schedule.first_charge.size + 1, dtype=np.int32)
    first[0::2], first[1::2] = schedule.first_block, schedule.first_charge
    return schedule._replace(
        chunk=np.concatenate([kept, left_out]).astype(np.int32),
        first_block=first,
        first_charge=np.repeat(schedule.first_charge, 2),
    )
