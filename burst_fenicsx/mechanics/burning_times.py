"""How fast the cells of the charges burn, and how long a detonation front is under way."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from mpi4py import MPI

if TYPE_CHECKING:
    from burst_fenicsx.mechanics.fields import BurstFields

__all__ = ["BurningTimes"]

# After the last cell has burnt out, the front is reflected from the casing for about this long (s).
_REFLECTION = 10e-6


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

    def front_is_active(self, time: float) -> bool:
        """Whether at a time (s) a detonation front runs or is being reflected from the casing."""
        return time < self.end + _REFLECTION
