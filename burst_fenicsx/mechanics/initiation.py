"""Initiation of a charge by shock: a neighbour's, a plate's, or whatever else presses on it.

An unreacted cell is ignited where its pressure has stayed at or above a threshold for a given time. From there a
detonation runs through the charge at D, as from an ignition point (Eqs. 4-5). A cell that no front is about to reach
ignites by itself, so that a wide shock makes several sources.

The pressure is that of the unreacted explosive on its Hugoniot. The artificial viscous pressure does not
count: it exists only while a cell is being compressed, for as long as the cell is wide, and would tie the threshold to
the cell size.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

from burst_fenicsx.mechanics.detonation import compression_burn_start, ignition_times
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.problem import Round


_BELOW = -1.0  # held time of a cell whose pressure is below the threshold


@dataclass(frozen=True, order=True)
class Source:
    """Where a charge was initiated by shock: time (s), number of the cell in the mesh that was given, its place (m)."""

    time: float
    cell: int
    place: tuple[float, float, float]


class ShockInitiations:
    """Watches the charges that a shock may initiate.

    Parameters
    ----------
    rounds : of the problem. fields : the state at rest; ignition times are set in its charge.

    Attributes
    ----------
    waiting : whether any cell on any rank may still ignite by itself; the same on every rank.
    sources : of each round, the first that initiated it by shock; None before, and where nothing did.
    held : (watched cells,) s for which each watched cell's pressure has been high; negative where it is not.
    """

    def __init__(self, rounds: Sequence[Round], fields: BurstFields) -> None:
        mesh = fields.mesh
        self._fields = fields
        self._velocity = [item.explosive.detonation_velocity for item in rounds]
        own = zip(self._velocity, fields.products, strict=True)
        self._fastest = [max(velocity, products.front_speed) for velocity, products in own]
        pressure = np.array([item.initiation.pressure if item.initiation else np.inf for item in rounds])
        duration = np.array([item.initiation.duration if item.initiation else np.inf for item in rounds])
        watched = np.isfinite(pressure)[mesh.round] & (mesh.part == Part.CHARGE)
        self._cell = np.flatnonzero(watched).astype(np.int32)
        self._round = mesh.round[self._cell]
        self._threshold = pressure[self._round]
        self._duration = duration[self._round]
        self._centre = fields.start[mesh.dofmap[self._cell]].mean(axis=1)
        self.held = np.full(len(self._cell), _BELOW)
        self.sources: list[Source | None] = [None] * len(rounds)
        self.waiting = True

    @classmethod
    def of_rounds(cls, rounds: Sequence[Round], fields: BurstFields) -> ShockInitiations | None:
        """Build where a round has `initiation`; None where none has."""
        return cls(rounds, fields) if any(item.initiation is not None for item in rounds) else None

    def update(self, time: float, step: float) -> bool:
        """Ignite what the shock has pressed long enough; collective while anything waits.

        Parameters
        ----------
        time : of the state, after its forces (s). step : the step that led there (s).

        Returns
        -------
        Whether anything was initiated: the largest burn rate and the time by which all is burnt out have changed then.
        """
        if not self.waiting:
            return False
        charge, comm = self._fields.charge, self._fields.mesh.comm
        # Cells near a front are left to it.
        ahead = time < charge.compression_from[self._cell]
        pressed = charge.pressure[self._cell] >= self._threshold
        longer = np.where(self.held >= 0.0, self.held + step, 0.0)
        self.held[ahead] = np.where(pressed, longer, _BELOW)[ahead]
        own = np.flatnonzero(ahead & pressed & (self.held >= self._duration))
        counts = np.array([len(own), np.count_nonzero(ahead)])
        counts = comm.allreduce(counts) if comm.size > 1 else counts
        self.waiting = bool(counts[1] > 0)
        if counts[0] == 0:
            return False
        number = self._fields.mesh.cell[self._cell[own]]
        found = [
            (int(self._round[k]), Source(float(time - (self.held[k] - self._duration[k])), int(cell), _place(centre)))
            for k, cell, centre in zip(own, number, self._centre[own], strict=True)
        ]
        if comm.size > 1:
            found = [item for piece in comm.allgather(found) for item in piece]
        # In the order of time and cell, whatever rank has found them.
        for index, source in sorted(found):
            self.sources[index] = self.sources[index] or source
        for index in {index for index, _ in found}:
            self._ignite(index, [source for of_round, source in found if of_round == index])
        return True

    def is_pressed(self) -> bool:
        """Whether a shock presses on a cell that waits, at its threshold or above, on any rank; collective."""
        if not self.waiting:
            return False
        ahead = self._fields.charge.compression_from[self._cell] == np.inf
        pressed, comm = bool((ahead & (self.held >= 0.0)).any()), self._fields.mesh.comm
        return bool(comm.allreduce(pressed, op=MPI.LOR)) if comm.size > 1 else pressed

    def _ignite(self, index: int, sources: Sequence[Source]) -> None:
        """Send fronts at D from the sources through the charge of a round."""
        charge = self._fields.charge
        own = np.flatnonzero(self._round == index)
        cells = self._cell[own]
        positions = np.array([source.place for source in sources])
        times = np.array([source.time for source in sources])
        arrival = ignition_times(self._centre[own], positions, times, self._velocity[index])
        charge.ignition_time[cells] = np.minimum(charge.ignition_time[cells], arrival)
        earliest = compression_burn_start(
            ignition_times(self._centre[own], positions, times, self._fastest[index]), charge.burn_rate[cells]
        )
        charge.compression_from[cells] = np.minimum(charge.compression_from[cells], earliest)

    def arrays(self) -> dict[str, np.ndarray]:
        """What a checkpoint keeps of this rank besides the times of the charge's cells."""
        rows = [(one.time, one.cell, *one.place) if one else (np.inf, -1, 0.0, 0.0, 0.0) for one in self.sources]
        return {"held": self.held, "sources": np.array(rows)}

    def restore(self, arrays: Mapping[str, np.ndarray]) -> None:
        """Go on from what `arrays` gave; whether anything waits shows at the next update."""
        self.held[:] = arrays["held"]
        self.sources = [
            Source(float(row[0]), int(row[1]), _place(row[2:])) if np.isfinite(row[0]) else None
            for row in arrays["sources"]
        ]
        self.waiting = True


def _place(values: np.ndarray) -> tuple[float, float, float]:
    return float(values[0]), float(values[1]), float(values[2])
