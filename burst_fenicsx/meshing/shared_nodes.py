"""Nodes that ranks share: values of all ranks summed at their owners, and brought back from them, by dolfinx."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from dolfinx import fem

from burst_fenicsx import compat

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.meshing.distributed import DistributedMesh

__all__ = ["SharedNodes"]


class SharedNodes:
    """Exchange of nodal vectors (local nodes, 3) between the ranks; on one rank there is none.

    Parameters
    ----------
    mesh : this rank's share of the mesh.
    """

    def __init__(self, mesh: DistributedMesh) -> None:
        self._function: Any = None
        if mesh.comm.size == 1:
            return
        self._function = fem.Function(mesh.vector_space)
        self._values = self._function.x.array.reshape(-1, 3)
        # Owners of shared nodes get something from the ghosts.
        self._values[mesh.dolfinx_node[mesh.owned_nodes :]] = 1.0
        compat.add_to_owners(self._function)
        self._rows = np.flatnonzero(self._values[mesh.dolfinx_node, 0] > 0.0)
        self._at = mesh.dolfinx_node[self._rows]

    def add_to_owners(self, values: np.ndarray) -> None:
        """Add what ghosts hold to their owners; the ghosts keep it. Collective."""
        self._exchange(compat.add_to_owners, values)

    def send_to_ghosts(self, values: np.ndarray) -> None:
        """Copy the owners' values to the ghosts; collective."""
        self._exchange(compat.send_to_ghosts, values)

    def _exchange(self, step: Callable[[Any], None], values: np.ndarray) -> None:
        if self._function is None:
            return
        self._values[self._at] = values[self._rows]
        step(self._function)
        values[self._rows] = self._values[self._at]
