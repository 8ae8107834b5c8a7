"""How long the next step is, which cells take a fraction of it, and how long charges burn."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.kernels.constants import (
    BURN_PER_STEP,
    CONTACT_FRACTION,
    EARLIEST_FRONT,
    FEWEST_STEPS,
    LOCAL_CFL,
    MIN_FRACTION,
    PRODUCTS_HELD,
    REFLECTION_TIME,
    STEP_GROWTH,
    STEPS_PER_CHOICE,
)
from burst_fenicsx.mechanics.schedule import AT_REST

if TYPE_CHECKING:
    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.mechanics.nodal_loads import NodalLoads
    from burst_fenicsx.mechanics.subcycling import Subcycling
    from burst_fenicsx.problem import TimeStep


class StepControl:
    """Chooses the macro step and, with local time stepping, the levels of the cells.

    Parameters
    ----------
    fields : the state.
    settings : of the time step.
    levels : what gives levels to the cells.
    burning : how long cells burn.
    loads : forces that are taken at the ends of the macro steps alone: with any, all cells take these.

    Attributes
    ----------
    local : whether cells take steps of their own.
    stable_step : stable limit of the macro step now (s). uncut_step : the last one (s) before it was cut to meet an
        output.
    chosen_at, choose_again : times (s) when the levels were and are to be chosen.
    contact_step : bound on contact's step (s).
    """

    def __init__(
        self,
        fields: BurstFields,
        settings: TimeStep,
        levels: Subcycling,
        burning: BurningTimes,
        loads: NodalLoads,
    ) -> None:
        self._fields = fields
        self._settings = settings
        self._levels = levels
        self._burning = burning
        self.local = settings.subcycling and settings.fixed is None and not loads.any
        self.stable_step = np.inf
        self.uncut_step = 0.0
        self.chosen_at, self.choose_again = 0.0, 0.0
        self.contact_step = np.inf

    def take_stable_step(self, of_cells: np.ndarray) -> None:
        """Take the limits (chunks,) in s of this rank's cells over to the stable step; collective."""
        self.stable_step = self._minimum(of_cells)
        if self.contact_step == np.inf:  # at rest, before the first step
            burn = BURN_PER_STEP / self._burning.fastest
            self.contact_step = min(CONTACT_FRACTION * self._settings.cfl * self.stable_step, burn)

    def next_step(self, time: float, until: float) -> float:
        """Size of the next macro step (s) at a time (s): a fraction of the stable one, or the fixed one."""
        step = self._wanted
        if self.local:
            step = min(step, self._levels.step)
        elif self._settings.fixed is None and time < self._burning.end:
            step = min(step, BURN_PER_STEP / self._burning.fastest)
        if self.uncut_step > 0.0:
            step = min(step, STEP_GROWTH * self.uncut_step)
        self.uncut_step = step
        left = until - time
        # Two equal steps rather than a full and a tiny one.
        return min(step, left if left <= step else max(0.5 * left, 1e-3 * step))

    @property
    def _wanted(self) -> float:
        return self._settings.fixed or self._settings.cfl * self.stable_step

    def levels_are_due(self, time: float) -> bool:
        """Whether the levels are to be chosen again: in their turn, or early where cells have got thin."""
        if not self.local:
            return False
        wanted, chosen = self._wanted, self._levels.step
        waited = time > self.chosen_at + FEWEST_STEPS * chosen or wanted < 0.5 * chosen
        return time >= self.choose_again or (wanted < MIN_FRACTION * chosen and waited)

    def choose_levels(self, time: float) -> np.ndarray | None:
        """Choose the macro step and the levels (cells,) of the cells; None where no level changes. Collective.

        Cells that nothing reaches until the next choice take no steps. The macro step does not depend on them.
        """
        state, levels, cfl = self._fields, self._levels, self._settings.cfl
        old_levels, old_contact, old_step = state.blocks.cell_levels, levels.contact_level, levels.step
        stable = state.blocks.by_cell(state.grid.stable)
        own = min(LOCAL_CFL, cfl)
        # Together, cells may take more of their stable steps than where steps differ.
        together = self._minimum(self._allowed(time, cfl * self._minimum(stable), cfl * stable))
        new_levels = levels.choose(
            lambda step: self._allowed(time, step, own * stable),
            together,
            self.contact_step if levels.contact else None,
        )
        resting = state.at_rest_until > time + (STEPS_PER_CHOICE + 2) * levels.step
        new_levels = np.where(resting, np.int8(AT_REST), new_levels)
        self.chosen_at, self.choose_again = time, time + STEPS_PER_CHOICE * levels.step
        state.grid = state.grid._replace(longest=levels.step)
        changed = levels.contact_level != old_contact or old_step == 0.0 or not np.array_equal(new_levels, old_levels)
        comm = state.mesh.comm
        if not (comm.allreduce(changed, op=MPI.LOR) if comm.size > 1 else changed):
            return None
        # The step of contact goes on smoothly.
        self.uncut_step *= 2.0 ** (levels.contact_level - old_contact) if levels.contact else 0.0
        return new_levels

    def _allowed(self, time: float, step: float, stable: np.ndarray) -> np.ndarray:
        """Steps (cells,) in s that cells may take till the next choice if the macro step is `step`.

        `stable` (cells,) is what their own stability allows. A front and what follows close behind it are left to cells
        of one step.
        """
        charge, allowed = self._fields.charge, stable.copy()
        with np.errstate(divide="ignore"):
            passed = charge.ignition_time + PRODUCTS_HELD / charge.burn_rate
        horizon = time + (STEPS_PER_CHOICE + 2) * step
        soon = np.isfinite(passed) & (passed > time) & (EARLIEST_FRONT * charge.ignition_time < horizon)
        allowed[soon] = np.minimum(allowed[soon], BURN_PER_STEP / charge.burn_rate[soon])
        return allowed

    def _minimum(self, values: np.ndarray) -> float:
        minimum, comm = float(values.min(initial=np.inf)), self._fields.mesh.comm
        return float(comm.allreduce(minimum, op=MPI.MIN)) if comm.size > 1 else minimum


class BurningTimes:
    """Times of the charges on all ranks.

    Parameters
    ----------
    fields : the state; to be made on all ranks.

    Attributes
    ----------
    fastest : the largest burn rate (1/s) of the initiated cells. end : time (s) by which they have burnt out, 0 where
        there are none.
    """

    def __init__(self, fields: BurstFields) -> None:
        self._fields = fields
        self.update()

    def update(self) -> None:
        """Find both again where ignition times have changed; collective."""
        charge, comm = self._fields.charge, self._fields.mesh.comm
        initiated = np.isfinite(charge.ignition_time) & (charge.burn_rate > 0.0)
        rate = float(charge.burn_rate[initiated].max(initial=1e-300))
        end = float((charge.ignition_time[initiated] + 1.0 / charge.burn_rate[initiated]).max(initial=0.0))
        several = comm.size > 1
        self.fastest: float = comm.allreduce(rate, op=MPI.MAX) if several else rate
        self.end: float = comm.allreduce(end, op=MPI.MAX) if several else end

    @property
    def front_until(self) -> float:
        """Time (s) until which a detonation front runs or is being reflected from the casing."""
        return self.end + REFLECTION_TIME
