"""The casing's velocity as a dolfinx function, evaluated at the fragments' points."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from transition.errors import InputError
from transition.meridian import bilinear
from transition.shape_functions import trilinear

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from transition.snapshot import Snapshot

__all__ = ["MeridianVelocityField", "VelocityField"]

_TENSOR_ORDER = [0, 1, 3, 2, 4, 5, 7, 6]  # VTK's nodes in dolfinx's order, x fastest
_TENSOR_ORDER_OF_QUADS = [0, 1, 3, 2]


class VelocityField:
    """Velocity of the casing as a vector Lagrange-1 function (Eq. 30: v = sum of w_k v_k).

    The function lives on the mesh before the burst, where every cell is well shaped; a material point keeps its
    coordinates in the cell, so the weights are those of the deformed cell, and the pull-back never meets a cell that
    the burst has bent out of shape.

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
        fem, MPI, compat = _dolfinx()
        cells = snapshot.cells[snapshot.casing][:, _TENSOR_ORDER]
        nodes, compact = np.unique(cells, return_inverse=True)
        compact = compact.reshape(cells.shape)
        self._corners = snapshot.reference[snapshot.cells[snapshot.casing]]
        domain = compat.create_hexahedral_mesh(
            MPI.COMM_SELF, compact, snapshot.reference[nodes], np.zeros(len(cells), dtype=np.int32)
        )
        original = np.asarray(domain.topology.original_cell_index)
        self._local = np.empty(len(cells), dtype=np.int32)
        self._local[original] = np.arange(len(cells), dtype=np.int32)
        self._velocity = fem.Function(compat.vector_space(domain), name="velocity")
        values = self._velocity.x.array.reshape(-1, 3)
        values[compat.cells_dofmap(self._velocity.function_space)] = snapshot.velocity[cells[original]]

    def at(self, cell: NDArray[np.int64], point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Velocities (n, 3) in m/s at the coordinates `point` (n, 3), 0 to 1, of casing cells `cell` (n,)."""
        places = trilinear(self._corners[cell], point)
        return np.asarray(self._velocity.eval(places, self._local[cell])).reshape(-1, 3)


class MeridianVelocityField:
    """Velocity of an axisymmetric casing as a vector Lagrange-1 function on the quadrilaterals of its meridian.

    As `VelocityField`, in radius and height: the function lives on the meridian before the burst.

    Parameters
    ----------
    snapshot : Snapshot
        End of an axisymmetric burst.

    Raises
    ------
    InputError
        dolfinx is not installed.
    """

    def __init__(self, snapshot: Snapshot) -> None:
        fem, MPI, compat = _dolfinx()
        half = snapshot.half_plane
        cells = snapshot.cells[snapshot.casing]
        self._corners = half.coordinates(snapshot.reference[cells])
        ordered = cells[:, _TENSOR_ORDER_OF_QUADS]
        nodes, compact = np.unique(ordered, return_inverse=True)
        domain = compat.create_quadrilateral_mesh(
            MPI.COMM_SELF, compact.reshape(ordered.shape), half.coordinates(snapshot.reference[nodes])
        )
        original = np.asarray(domain.topology.original_cell_index)
        self._local = np.empty(len(cells), dtype=np.int32)
        self._local[original] = np.arange(len(cells), dtype=np.int32)
        self._velocity = fem.Function(compat.vector_space(domain), name="velocity")
        values = self._velocity.x.array.reshape(-1, 2)
        at_nodes = half.components(snapshot.velocity)
        values[compat.cells_dofmap(self._velocity.function_space)] = at_nodes[ordered[original]]

    def at(self, cell: NDArray[np.int64], point: NDArray[np.float64]) -> NDArray[np.float64]:
        """Radial and axial velocity (n, 2) in m/s at the coordinates `point` (n, 2), 0 to 1, of casing cells `cell`."""
        places = np.column_stack([bilinear(self._corners[cell], point), np.zeros(len(cell))])
        return np.asarray(self._velocity.eval(places, self._local[cell])).reshape(-1, 2)


def _dolfinx() -> tuple[Any, Any, Any]:
    """The modules dolfinx.fem, mpi4py.MPI and burst_fenicsx.compat."""
    try:
        from dolfinx import fem
        from mpi4py import MPI

        from burst_fenicsx import compat
    except ImportError as error:
        raise InputError(
            f"break_up.velocity = 'interpolation' needs dolfinx ({error}); 'mean' works without it"
        ) from None
    return fem, MPI, compat
