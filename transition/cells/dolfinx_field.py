"""The casing's velocity as a dolfinx function, evaluated at the fragments' points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from transition.cells.meridian import bilinear
from transition.cells.shape_functions import trilinear
from transition.errors import InputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.snapshot import Snapshot

__all__ = ["VelocityField"]

_TENSOR_ORDER = [0, 1, 3, 2, 4, 5, 7, 6]  # VTK's nodes in dolfinx's order, x fastest


class VelocityField:
    """Velocity of the casing as a vector Lagrange-1 function (Eq. 30: v = sum of w_k v_k).

    The function lives on the mesh before the burst, where every cell is well shaped; a material point keeps its
    coordinates in the cell, so the weights are those of the deformed cell, and the pull-back never meets a cell that
    the burst has bent out of shape. The cells are hexahedra, or the quadrilaterals of a meridian in its half plane.

    Parameters
    ----------
    snapshot : Snapshot
        End of the burst stage.

    Raises
    ------
    InputError
        dolfinx is not installed.
    """

    def __init__(self, snapshot: Snapshot) -> None:
        try:
            from dolfinx import fem
            from mpi4py import MPI

            from burst_fenicsx import compat
        except ImportError as error:
            raise InputError(
                f"break_up.velocity = 'interpolation' needs dolfinx ({error}); 'mean' works without it"
            ) from None

        corners = snapshot.cells[snapshot.casing]
        self._corners = snapshot.reference[corners]
        self._interpolate = bilinear if snapshot.is_axisymmetric else trilinear
        cells = corners[:, _TENSOR_ORDER[: corners.shape[1]]]
        nodes, compact = np.unique(cells, return_inverse=True)
        compact, positions = compact.reshape(cells.shape), snapshot.reference[nodes]
        if snapshot.is_axisymmetric:
            domain = compat.create_quadrilateral_mesh(MPI.COMM_SELF, compact, positions)
        else:
            owner = np.zeros(len(cells), dtype=np.int32)
            domain = compat.create_hexahedral_mesh(MPI.COMM_SELF, compact, positions, owner)
        original = np.asarray(domain.topology.original_cell_index)
        self._local = np.empty(len(cells), dtype=np.int32)
        self._local[original] = np.arange(len(cells), dtype=np.int32)
        self._velocity = fem.Function(compat.vector_space(domain), name="velocity")
        values = self._velocity.x.array.reshape(-1, 3)
        values[compat.cells_dofmap(self._velocity.function_space)] = snapshot.velocity[cells[original]]

    def at(self, cell: NDArray[np.int64], point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Velocities (n, 3) in m/s at coordinates 0 to 1 of casing cells `cell` (n,).

        `point` is (n, 3) in hexahedra, (n, 2) in quadrilaterals, whose velocities lie in the half plane.
        """
        positions = self._interpolate(self._corners[cell], point)
        return np.asarray(self._velocity.eval(positions, self._local[cell])).reshape(-1, 3)
