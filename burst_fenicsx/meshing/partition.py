"""Which rank steps which cell: sectors of the rounds, which stay equally busy while a front runs along the axis.

Cells near the front take the shortest steps, and all ranks wait for the slowest in each of them. Of slabs across the
axis those with the front work while the others wait. Sectors have the same share of every layer, of charge and casing,
and so of every level of local time stepping, at any time; what is left uneven is what a neighbour or a plane does.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from burst_fenicsx.meshing.mesh import cell_centres
from burst_fenicsx.meshing.placement import to_local
from burst_fenicsx.problem import Part

if TYPE_CHECKING:
    from collections.abc import Sequence

    from numpy.typing import NDArray

    from burst_fenicsx.meshing.mesh import HexahedralMesh
    from burst_fenicsx.problem import Round

__all__ = ["partition"]

_COST_OF_CHARGE = 0.8  # of a casing's cell and step: the kernels' times in benchmarks/README.md
_SAME_AZIMUTH = 1e-6  # rad; of layers that lie behind each other


def partition(mesh: HexahedralMesh, rounds: Sequence[Round], ranks: int) -> NDArray[np.int32]:
    """Rank of every cell (cells,): equal costs in the order of rounds, azimuths and stations.

    With as many ranks as rounds or fewer, ranks have whole rounds as far as they are alike; with more, sectors; with
    more than there are cells around, pieces of sectors along the axis.

    Parameters
    ----------
    mesh : all cells. rounds : in order; where they stand. ranks : how many there are.
    """
    azimuth = np.zeros(len(mesh.cells))
    centres = cell_centres(mesh)
    for index, item in enumerate(rounds):
        own = mesh.round == index
        local = to_local(centres[own], item.position, item.axis)
        azimuth[own] = np.round(np.arctan2(local[:, 1], local[:, 0]) / _SAME_AZIMUTH)
    order = np.lexsort((mesh.station, azimuth, mesh.round))
    cost = np.where(mesh.part == Part.CHARGE, _COST_OF_CHARGE, 1.0)[order]
    # A cell belongs to the share in which its middle lies.
    reached = np.cumsum(cost) - 0.5 * cost
    owner = np.empty(len(order), dtype=np.int32)
    owner[order] = np.minimum(reached / cost.sum() * ranks, ranks - 1)
    return owner
