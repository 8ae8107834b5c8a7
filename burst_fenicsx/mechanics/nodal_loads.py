"""What acts on nodes besides cells and contact: external forces and damping with their work, and constrained nodes."""

from __future__ import annotations

from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.kernels.state import HeldNodes

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.mechanics.fields import BurstFields
    from burst_fenicsx.mechanics.ledger import Ledger


class NodalConstraint:
    """Nodes that may not move along a direction, such as those of a symmetry plane.

    Parameters
    ----------
    nodes : (k,) local nodes. direction : (3,) unit vector.
    """

    def __init__(self, nodes: np.ndarray, direction: np.ndarray) -> None:
        self.nodes = np.asarray(nodes, dtype=np.int64)
        self.direction = np.asarray(direction, dtype=float)


@lru_cache(maxsize=1)  # of the solver that steps
def held_nodes(constraints: tuple[NodalConstraint, ...]) -> HeldNodes:
    """The nodes of all constraints, one after the other, as the kernels take them."""
    nodes = [item.nodes for item in constraints]
    return HeldNodes(
        direction=np.array([item.direction for item in constraints]).reshape(-1, 3),
        first=np.cumsum([0, *(len(some) for some in nodes)]),
        node=np.concatenate([np.zeros(0, dtype=np.int64), *nodes]),
    )


class NodalLoads:
    """External forces and damping, taken at the ends of the macro steps.

    Parameters
    ----------
    fields : the state.
    damping : rate (1/s) at which nodes lose their momentum; zero for none.
    external : called with the time (s) and the forces (nodes, 3) in N, to which it adds external ones.
    """

    def __init__(
        self, fields: BurstFields, damping: float, external: Callable[[float, np.ndarray], None] | None
    ) -> None:
        self._fields = fields
        self._rate = damping
        self._external = external
        self._external_force = np.zeros_like(fields.nodes.force) if external else None
        self._damping_force = np.zeros_like(fields.nodes.force) if damping > 0.0 else None

    @property
    def any(self) -> bool:
        """Whether there are any: then all cells take the macro step."""
        return self._external_force is not None or self._damping_force is not None

    def add_forces(self, time: float) -> None:
        """Add the forces (N) at a time (s) to those of this rank's nodes, shared ones as well."""
        nodes = self._fields.nodes
        if self._external_force is not None and self._external is not None:
            self._external_force[:] = 0.0
            self._external(time, self._external_force)
            nodes.force[:] += self._external_force
        if self._damping_force is not None:
            self._damping_force[:] = -self._rate * self._fields.mass[:, None] * nodes.velocity
            nodes.force[:] += self._damping_force

    def accumulate_work(self, ledger: Ledger, half_step: float) -> None:
        """Accumulate the work over half a step (s), the first half by the old forces; collective."""
        if self._external_force is not None:
            work = half_step * self._power(self._external_force)
            ledger.external_work += work if self._fields.mesh.comm.rank == 0 else 0.0
        if self._damping_force is not None:
            ledger.damping -= half_step * self._power(self._damping_force)

    def _power(self, force: np.ndarray) -> float:
        return float(self._fields.mesh.node_sums((force * self._fields.nodes.velocity).sum(axis=1)))
