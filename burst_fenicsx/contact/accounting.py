"""Energy accounting of nodal contact, the same for surfaces and for planes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from burst_fenicsx.kernels.rows import sum_columns

if TYPE_CHECKING:
    import numpy as np

    from burst_fenicsx.kernels.planes import PlaneState
    from burst_fenicsx.kernels.springs import Collisions

__all__ = ["NodeContact"]


class NodeContact:
    """Contact of this rank's nodes; `state` holds the kernels' arrays."""

    state: Collisions | PlaneState

    @property
    def energies(self) -> np.ndarray:
        """Spring energy now, friction and work of the stiffness in the last step (J), on this rank's nodes."""
        total: np.ndarray = sum_columns(self.state.energies)
        return total
