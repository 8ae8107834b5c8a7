"""Stress of the cells projected to the nodes, for smooth contours in ParaView."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from dolfinx import fem
from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.kernels.vectors.exact import quantise, rounding_constant
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from burst_fenicsx.mechanics.fields import BurstFields

__all__ = ["nodal_stress"]

_SMALLEST = 1e-200  # bound where there is no stress at all, Pa m3
_COLUMNS = 9  # volume and six components, filled up to three vectors for the exchange between ranks


def nodal_stress(state: BurstFields, stress: np.ndarray, volume: np.ndarray) -> np.ndarray:
    """L2 projection with lumped mass, the mean of a node's cells by volume: (local nodes, 6) in Pa; collective.

    The consistent mass would need a solve and overshoots beside jumps such as shocks; this mean does not. Where metal
    and charge share nodes, these have the metal's. Eroded cells do not count; a node with none but these has zero.

    Parameters
    ----------
    state : the burst. stress : of the cells (owned cells, 6) in Pa. volume : of the cells (owned cells,) in m3.
    """
    charge, whole = state.mesh.part == Part.CHARGE, ~state.eroded
    metal, gas = (_sums(state, stress, np.where(whole & kind, volume, 0.0)) for kind in (~charge, charge))
    sums = np.where(metal[:, :1] > 0.0, metal, gas)
    return np.divide(sums[:, 1:7], sums[:, :1], out=np.zeros((len(sums), 6)), where=sums[:, :1] > 0.0)


def _sums(state: BurstFields, stress: np.ndarray, weight: np.ndarray) -> np.ndarray:
    """Weights (m3) and weighted stresses (Pa m3) summed at the nodes, (local nodes, `_COLUMNS`); exactly, as forces."""
    dofmap, comm = state.mesh.dofmap, state.mesh.comm
    node, corners = dofmap.ravel(), dofmap.shape[1]
    sums = np.zeros((len(state.mesh.node), _COLUMNS))
    weighted = np.where(weight[:, None] > 0.0, weight[:, None] * stress, 0.0)  # eroded cells may hold NaN
    for column, values in enumerate([weight, *weighted.T]):
        largest = comm.allreduce(float(np.abs(values).max(initial=0.0)), op=MPI.MAX)
        terms = quantise(values / corners, rounding_constant(max(largest, _SMALLEST)))
        sums[:, column] = np.bincount(node, np.repeat(terms, corners), minlength=len(sums))
    exchanged = fem.Function(state.mesh.vector_space)
    vectors = exchanged.x.array.reshape(-1, 3)
    for first in range(0, _COLUMNS, 3):
        vectors[:] = sums[:, first : first + 3]
        compat.add_to_owners(exchanged)
        compat.send_to_ghosts(exchanged)
        sums[:, first : first + 3] = vectors
    return sums
