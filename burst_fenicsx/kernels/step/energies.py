"""What the ledger takes of every node and cell: kinetic and elastic energies, momenta, speeds of cells."""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.lanes import kernel

__all__ = ["elastic_energies", "mean_speeds", "node_terms"]


@kernel
def node_terms(
    half_step: float,
    mass: np.ndarray,
    inverse_mass: np.ndarray,
    velocity: np.ndarray,
    force: np.ndarray,
    terms: np.ndarray,
) -> None:
    """Kinetic energy (J), momentum (kg m/s) and its size of every node, (nodes, 5).

    The velocities (nodes, 3) in m/s are brought on by `half_step` (s) under the `force` (nodes, 3) in N.
    """
    for node in range(mass.size):
        square = 0.0
        for i in range(3):
            momentum = mass[node] * velocity[node, i] + half_step * force[node, i]
            terms[node, 1 + i] = momentum
            square += momentum * momentum
        terms[node, 0], terms[node, 4] = 0.5 * square * inverse_mass[node], np.sqrt(square)


@kernel
def elastic_energies(
    cells: np.ndarray,
    stress: np.ndarray,
    modulus: np.ndarray,
    poisson: np.ndarray,
    volume: np.ndarray,
    slot: np.ndarray,
    terms: np.ndarray,
) -> None:
    """Elastic energies in J of the solid `cells` (k,), of moduli (k,) in Pa and Poisson's ratios (k,).

    `stress` (cells, points, 6) Pa, `volume` (slots,) m3, `slot` (cells,); into the first column of `terms` (cells, n).
    """
    points = stress.shape[1]
    for k in range(cells.size):
        twice, cell = 0.0, cells[k]
        for point in range(points):
            xx, yy, zz = stress[cell, point, 0], stress[cell, point, 1], stress[cell, point, 2]
            xy, yz, zx = stress[cell, point, 3], stress[cell, point, 4], stress[cell, point, 5]
            square = xx * xx + yy * yy + zz * zz + 2.0 * (xy * xy + yz * yz + zx * zx)
            twice += (1.0 + poisson[k]) * square - poisson[k] * (xx + yy + zz) ** 2
        terms[cell, 0] = 0.5 * volume[slot[cell]] * twice / (modulus[k] * points)


@kernel
def mean_speeds(velocity: np.ndarray, dofmap: np.ndarray, cells: np.ndarray, speed: np.ndarray) -> None:
    """Sizes `speed` (k,) in m/s of the means of the velocities at the corners of the `cells` (k,)."""
    corners = dofmap.shape[1]
    for k in range(cells.size):
        square = 0.0
        for i in range(3):
            total = 0.0
            for n in range(corners):
                total += velocity[dofmap[cells[k], n], i]
            square += (total / corners) ** 2
        speed[k] = np.sqrt(square)
