"""Sums over all nodes and cells for the ledger, each in one pass: partial sums of equal runs, to be added in order."""

from __future__ import annotations

import numba
import numpy as np

from burst_fenicsx.kernels.hexahedron import gather_modes, mean_gradient
from burst_fenicsx.kernels.lanes import LANES, parallel_kernel

__all__ = ["node_sums", "solid_sums"]


@parallel_kernel
def node_sums(half_step: float, mass: np.ndarray, force: np.ndarray, velocity: np.ndarray, partial: np.ndarray) -> None:
    """Kinetic energy (J), momentum (kg m/s, three columns) and the sum of its sizes, at the time of the positions.

    The velocities are brought on by `half_step` (s) under the `force` (nodes, 3) in N; `mass` (nodes,) kg; `partial`
    (parts, 5), overwritten.
    """
    parts, count = partial.shape[0], mass.size
    for part in numba.prange(parts):
        kinetic, px, py, pz, size = 0.0, 0.0, 0.0, 0.0, 0.0
        for node in range(part * count // parts, (part + 1) * count // parts):
            if mass[node] > 0.0:
                increment = half_step / mass[node]
                x = mass[node] * (velocity[node, 0] + increment * force[node, 0])
                y = mass[node] * (velocity[node, 1] + increment * force[node, 1])
                z = mass[node] * (velocity[node, 2] + increment * force[node, 2])
                square = x * x + y * y + z * z
                kinetic += 0.5 * square / mass[node]
                px, py, pz, size = px + x, py + y, pz + z, size + np.sqrt(square)
        partial[part, 0], partial[part, 1], partial[part, 2], partial[part, 3] = kinetic, px, py, pz
        partial[part, 4] = size


@parallel_kernel
def solid_sums(
    position: np.ndarray,
    velocity: np.ndarray,
    dofmap: np.ndarray,
    casing: np.ndarray,
    mass: np.ndarray,
    stress: np.ndarray,
    modulus: np.ndarray,
    poisson: np.ndarray,
    partial: np.ndarray,
) -> None:
    """Elastic energy of all cells (J), and mass (kg), momentum's size (kg m/s) and kinetic energy (J) of the casings.

    Parameters
    ----------
    position, velocity : (nodes, 3) m and m/s. dofmap : (cells, 8) in tensor-product order.
    casing : (cells,) bool. mass : (cells,) kg; a casing's cell moves with the mean velocity of its nodes.
    stress : (cells, points, 6) Pa. modulus, poisson : (cells,) Pa and 1; the modulus zero where nothing is elastic.
    partial : (parts, 4), overwritten.
    """
    parts, count, points = partial.shape[0], dofmap.shape[0], stress.shape[1]
    for part in numba.prange(parts):
        cells, volume = np.empty(LANES, dtype=np.int32), np.empty(LANES)
        modes, gradient = np.empty(24 * LANES), np.empty(18 * LANES)
        strain, weight, momentum, kinetic = 0.0, 0.0, 0.0, 0.0
        last = (part + 1) * count // parts
        for start in range(part * count // parts, last, LANES):
            elastic = False
            for lane in range(LANES):
                cells[lane] = min(start + lane, last - 1)
                elastic |= modulus[cells[lane]] > 0.0
            if elastic:
                gather_modes(cells, dofmap, position, modes)
                mean_gradient(modes, gradient, volume)
            for lane in range(min(LANES, last - start)):
                cell = cells[lane]
                if modulus[cell] > 0.0:
                    twice = 0.0
                    for point in range(points):
                        xx, yy, zz = stress[cell, point, 0], stress[cell, point, 1], stress[cell, point, 2]
                        xy, yz, zx = stress[cell, point, 3], stress[cell, point, 4], stress[cell, point, 5]
                        trace = xx + yy + zz
                        square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)
                        twice += (1.0 + poisson[cell]) * square - poisson[cell] * trace * trace
                    strain += 0.5 * volume[lane] * twice / (modulus[cell] * points)
                if casing[cell]:
                    square = 0.0
                    for i in range(3):
                        total = 0.0
                        for n in range(8):
                            total += velocity[dofmap[cell, n], i]
                        square += (0.125 * total) ** 2
                    weight += mass[cell]
                    momentum += mass[cell] * np.sqrt(square)
                    kinetic += 0.5 * mass[cell] * square
        partial[part, 0], partial[part, 1], partial[part, 2], partial[part, 3] = strain, weight, momentum, kinetic
