"""What every node and every cell adds to the ledger, each in one pass; it is summed by `mechanics.exact_sums`."""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.cells.hexahedron import block_volumes
from burst_fenicsx.kernels.lanes import LANES, parallel_kernel

__all__ = ["node_terms", "solid_terms"]

_RUN = 4096  # cells that a thread takes at a time


@parallel_kernel
def node_terms(half_step: float, mass: np.ndarray, force: np.ndarray, velocity: np.ndarray, terms: np.ndarray) -> None:
    """Kinetic energy (J), momentum (kg m/s, three columns) and its size of every node, at the time of the positions.

    The velocities are brought on by `half_step` (s) under the `force` (nodes, 3) in N; `mass` (nodes,) kg; `terms`
    (nodes, 5), overwritten.
    """
    for node in numba.prange(mass.size):
        kinetic, x, y, z, size = 0.0, 0.0, 0.0, 0.0, 0.0
        if mass[node] > 0.0:
            increment = half_step / mass[node]
            x = mass[node] * (velocity[node, 0] + increment * force[node, 0])
            y = mass[node] * (velocity[node, 1] + increment * force[node, 1])
            z = mass[node] * (velocity[node, 2] + increment * force[node, 2])
            square = x * x + y * y + z * z
            kinetic, size = 0.5 * square / mass[node], np.sqrt(square)
        terms[node, 0], terms[node, 1], terms[node, 2], terms[node, 3], terms[node, 4] = kinetic, x, y, z, size


@parallel_kernel
def solid_terms(
    position: np.ndarray,
    velocity: np.ndarray,
    dofmap: np.ndarray,
    casing: np.ndarray,
    mass: np.ndarray,
    stress: np.ndarray,
    modulus: np.ndarray,
    poisson: np.ndarray,
    terms: np.ndarray,
) -> None:
    """Elastic energy of every cell (J), and mass (kg), momentum's size (kg m/s) and kinetic energy (J) of the casings'.

    Parameters
    ----------
    position, velocity : (nodes, 3) m and m/s. dofmap : (cells, 8).
    casing : (cells,) bool. mass : (cells,) kg; a casing's cell moves with the mean velocity of its nodes.
    stress : (cells, points, 6) Pa. modulus, poisson : (cells,) Pa and 1; the modulus zero where nothing is elastic.
    terms : (cells, 4), overwritten.
    """
    count, points = dofmap.shape[0], stress.shape[1]
    for part in numba.prange((count + _RUN - 1) // _RUN):
        cells, volume = np.empty(LANES, dtype=np.int32), np.empty(LANES)
        nodal = np.empty(24 * LANES)
        last = min((part + 1) * _RUN, count)
        for start in range(part * _RUN, last, LANES):
            elastic = False
            for lane in range(LANES):
                cells[lane] = min(start + lane, last - 1)
                elastic |= modulus[cells[lane]] > 0.0
            if elastic:
                block_volumes(cells, dofmap, position, nodal, volume)
            for lane in range(min(LANES, last - start)):
                cell = cells[lane]
                terms[cell, :] = 0.0
                if modulus[cell] > 0.0:
                    twice = 0.0
                    for point in range(points):
                        xx, yy, zz = stress[cell, point, 0], stress[cell, point, 1], stress[cell, point, 2]
                        xy, yz, zx = stress[cell, point, 3], stress[cell, point, 4], stress[cell, point, 5]
                        trace = xx + yy + zz
                        square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)
                        twice += (1.0 + poisson[cell]) * square - poisson[cell] * trace * trace
                    terms[cell, 0] = 0.5 * volume[lane] * twice / (modulus[cell] * points)
                if casing[cell]:
                    square = 0.0
                    for i in range(3):
                        total = 0.0
                        for n in range(8):
                            total += velocity[dofmap[cell, n], i]
                        square += (0.125 * total) ** 2
                    terms[cell, 1] = mass[cell]
                    terms[cell, 2] = mass[cell] * np.sqrt(square)
                    terms[cell, 3] = 0.5 * mass[cell] * square
