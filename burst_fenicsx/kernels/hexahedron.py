"""The trilinear hexahedron in modal form, for a block of cells.

The eight nodal values of a field are replaced by their Walsh transform: the sums over the nodes
with the signs 1, xi, eta, zeta and their products. Node n of a cell sits at xi = +-1 by bit 0 of n,
eta by bit 1, zeta by bit 2 (the tensor-product order of dolfinx), and mode m likewise is the product
of the coordinates whose bits are set: 1 = xi, 2 = eta, 3 = xi eta, 4 = zeta, 5 = xi zeta,
6 = eta zeta, 7 = xi eta zeta.

In this form the mean gradient of Flanagan and Belytschko (1981) needs nine pairs of cross
products, and the hourglass modes are simply modes 3, 5, 6 and 7. With x = sum of coefficients
times modes, the derivative of the cell's volume by the place of node a is

    b_a = xi P + eta Q + zeta R + xi eta S3 + xi zeta S5 + eta zeta S6     (signs taken at a),

exactly (the integral of the shape function's gradient over the cell).

Scratch layout: a vector field's modes take 24 rows of `LANES`, row 3 m + i for component i of mode m.
"""

from __future__ import annotations

import numpy as np

from burst_fenicsx.kernels.exact import quantise
from burst_fenicsx.kernels.lanes import LANES, kernel

__all__ = [
    "add_nodal_forces",
    "gather_modes",
    "largest_gradient",
    "mean_gradient",
    "mid_step_modes",
    "velocity_gradient",
]


@kernel
def _transform(values: np.ndarray) -> None:
    """Walsh transform over the eight rows 3 n + i of each component, in place; it is its own inverse times 8."""
    for i in range(3):
        for lane in range(LANES):
            v0 = values[(0 + i) * LANES + lane]
            v1 = values[(3 + i) * LANES + lane]
            v2 = values[(6 + i) * LANES + lane]
            v3 = values[(9 + i) * LANES + lane]
            v4 = values[(12 + i) * LANES + lane]
            v5 = values[(15 + i) * LANES + lane]
            v6 = values[(18 + i) * LANES + lane]
            v7 = values[(21 + i) * LANES + lane]
            s01, d01 = v0 + v1, v1 - v0
            s23, d23 = v2 + v3, v3 - v2
            s45, d45 = v4 + v5, v5 - v4
            s67, d67 = v6 + v7, v7 - v6
            ss03, sd03 = s01 + s23, s23 - s01
            ds03, dd03 = d01 + d23, d23 - d01
            ss47, sd47 = s45 + s67, s67 - s45
            ds47, dd47 = d45 + d67, d67 - d45
            values[(0 + i) * LANES + lane] = ss03 + ss47
            values[(3 + i) * LANES + lane] = ds03 + ds47
            values[(6 + i) * LANES + lane] = sd03 + sd47
            values[(9 + i) * LANES + lane] = dd03 + dd47
            values[(12 + i) * LANES + lane] = ss47 - ss03
            values[(15 + i) * LANES + lane] = ds47 - ds03
            values[(18 + i) * LANES + lane] = sd47 - sd03
            values[(21 + i) * LANES + lane] = dd47 - dd03


@kernel
def gather_modes(cells: np.ndarray, dofmap: np.ndarray, field: np.ndarray, modes: np.ndarray) -> None:
    """Gather a nodal vector field of a block's cells and transform it to modes.

    Parameters
    ----------
    cells : (LANES,) int32, the block's cells (padded with its last one).
    dofmap : (cells, 8) int32, nodes in tensor-product order.
    field : (nodes, 3) float64.
    modes : (24 LANES,) float64, overwritten.
    """
    for lane in range(LANES):
        cell = cells[lane]
        for n in range(8):
            node = dofmap[cell, n]
            for i in range(3):
                modes[(3 * n + i) * LANES + lane] = field[node, i]
    _transform(modes)


@kernel
def mid_step_modes(position: np.ndarray, velocity: np.ndarray, half_step: float, middle: np.ndarray) -> None:
    """Modes of the positions half a step ago; the transform is linear, so no second gather is needed."""
    for k in range(3 * LANES, 24 * LANES):
        middle[k] = position[k] - half_step * velocity[k]


@kernel
def mean_gradient(modes: np.ndarray, gradient: np.ndarray, volume: np.ndarray) -> None:
    """Derivative of the cells' volumes by their nodes' places, in modal form, and the volumes.

    Parameters
    ----------
    modes : (24 LANES,) modes of the positions (m).
    gradient : (18 LANES,) rows 3 k + i: P, Q, R, S3, S5, S6 (m2), overwritten.
    volume : (LANES,) volumes (m3), overwritten.

    Notes
    -----
    Flanagan and Belytschko (1981), Eq. 15-21, rewritten for the coefficients a, b, c of xi, eta, zeta,
    d, e, f of eta zeta, xi zeta, xi eta (and g of xi eta zeta):
    P = b x c + f x e / 3, Q = c x a + d x f / 3, R = a x b + e x d / 3,
    S3 = (b x d + e x a) / 3 and so on by cycling; g drops out.
    """
    third = 1.0 / 3.0
    scale = 1.0 / 64.0
    for lane in range(LANES):
        volume[lane] = 0.0
    for i in range(3):
        j = (i + 1) % 3
        k = (i + 2) % 3
        for lane in range(LANES):
            aj, ak = modes[(3 + j) * LANES + lane], modes[(3 + k) * LANES + lane]
            bj, bk = modes[(6 + j) * LANES + lane], modes[(6 + k) * LANES + lane]
            fj, fk = modes[(9 + j) * LANES + lane], modes[(9 + k) * LANES + lane]
            cj, ck = modes[(12 + j) * LANES + lane], modes[(12 + k) * LANES + lane]
            ej, ek = modes[(15 + j) * LANES + lane], modes[(15 + k) * LANES + lane]
            dj, dk = modes[(18 + j) * LANES + lane], modes[(18 + k) * LANES + lane]
            p = scale * ((bj * ck - bk * cj) + third * (fj * ek - fk * ej))
            q = scale * ((cj * ak - ck * aj) + third * (dj * fk - dk * fj))
            r = scale * ((aj * bk - ak * bj) + third * (ej * dk - ek * dj))
            # f x g / 3 in P's eta part cancels g x f / 3 in Q's xi part; so do the other two pairs, and g drops out.
            s3 = third * scale * ((bj * dk - bk * dj) + (ej * ak - ek * aj))
            s5 = third * scale * ((dj * ck - dk * cj) + (aj * fk - ak * fj))
            s6 = third * scale * ((cj * ek - ck * ej) + (fj * bk - fk * bj))
            gradient[(0 + i) * LANES + lane] = p
            gradient[(3 + i) * LANES + lane] = q
            gradient[(6 + i) * LANES + lane] = r
            gradient[(9 + i) * LANES + lane] = s3
            gradient[(12 + i) * LANES + lane] = s5
            gradient[(15 + i) * LANES + lane] = s6
            # The volume is of third degree in the places: V = sum of x_a . b_a over three (Euler).
            volume[lane] += third * (
                modes[(3 + i) * LANES + lane] * p
                + modes[(6 + i) * LANES + lane] * q
                + modes[(12 + i) * LANES + lane] * r
                + modes[(9 + i) * LANES + lane] * s3
                + modes[(15 + i) * LANES + lane] * s5
                + modes[(18 + i) * LANES + lane] * s6
            )


@kernel
def velocity_gradient(velocity: np.ndarray, gradient: np.ndarray, volume: np.ndarray, rate: np.ndarray) -> None:
    """Mean velocity gradient L_ij = sum of v_ai b_aj / V (1/s), rows 3 i + j of `rate` (9 LANES,)."""
    for i in range(3):
        for j in range(3):
            for lane in range(LANES):
                rate[(3 * i + j) * LANES + lane] = (
                    velocity[(3 + i) * LANES + lane] * gradient[(0 + j) * LANES + lane]
                    + velocity[(6 + i) * LANES + lane] * gradient[(3 + j) * LANES + lane]
                    + velocity[(12 + i) * LANES + lane] * gradient[(6 + j) * LANES + lane]
                    + velocity[(9 + i) * LANES + lane] * gradient[(9 + j) * LANES + lane]
                    + velocity[(15 + i) * LANES + lane] * gradient[(12 + j) * LANES + lane]
                    + velocity[(18 + i) * LANES + lane] * gradient[(15 + j) * LANES + lane]
                ) / volume[lane]


@kernel
def largest_gradient(gradient: np.ndarray, volume: np.ndarray, length: np.ndarray) -> None:
    """Length of each cell that governs the stable step (m): c dt <= length.

    The highest frequency of the one-point cell with lumped mass is
    omega^2 = 8 c^2 lambda / V^2 with lambda the largest eigenvalue of sum b_a b_a^T (Flanagan and
    Belytschko 1981, Eq. 63), so length = 2 c / omega. The eigenvalue is bounded from above by
    trace/3 + sqrt(2/3) |deviator|, which is exact for cubes and for flat cells.
    """
    for lane in range(LANES):
        xx = yy = zz = xy = yz = zx = 0.0
        for k in range(6):
            gx = gradient[(3 * k + 0) * LANES + lane]
            gy = gradient[(3 * k + 1) * LANES + lane]
            gz = gradient[(3 * k + 2) * LANES + lane]
            xx += gx * gx
            yy += gy * gy
            zz += gz * gz
            xy += gx * gy
            yz += gy * gz
            zx += gz * gx
        mean = (xx + yy + zz) / 3.0
        deviator = (xx - mean) ** 2 + (yy - mean) ** 2 + (zz - mean) ** 2 + 2.0 * (xy * xy + yz * yz + zx * zx)
        largest = mean + np.sqrt(deviator * (2.0 / 3.0))
        length[lane] = volume[lane] / np.sqrt(16.0 * largest)


@kernel
def add_nodal_forces(
    count: int,
    cells: np.ndarray,
    dofmap: np.ndarray,
    modes: np.ndarray,
    share: float,
    rounding: float,
    force: np.ndarray,
) -> None:
    """Transform the modes of the nodal forces back, round them and add them to the nodes of the first `count` cells.

    `share` multiplies the forces; it is the cells' own step over the longest. `rounding` is the constant of `exact.quantise`: the sums do not depend on the order of the cells.
    """
    _transform_back(modes, share, rounding)
    for lane in range(count):
        cell = cells[lane]
        for n in range(8):
            node = dofmap[cell, n]
            for i in range(3):
                force[node, i] += modes[(3 * n + i) * LANES + lane]


@kernel
def _transform_back(values: np.ndarray, share: float, rounding: float) -> None:
    """Sum of the modes at the nodes: f_n = share times the sum over m of sign(m, n) F_m, in place, rounded."""
    for i in range(3):
        for lane in range(LANES):
            v0 = values[(0 + i) * LANES + lane]
            v1 = values[(3 + i) * LANES + lane]
            v2 = values[(6 + i) * LANES + lane]
            v3 = values[(9 + i) * LANES + lane]
            v4 = values[(12 + i) * LANES + lane]
            v5 = values[(15 + i) * LANES + lane]
            v6 = values[(18 + i) * LANES + lane]
            v7 = values[(21 + i) * LANES + lane]
            a0, a1 = v0 - v1, v0 + v1
            a2, a3 = v2 - v3, v2 + v3
            a4, a5 = v4 - v5, v4 + v5
            a6, a7 = v6 - v7, v6 + v7
            b0, b2 = a0 - a2, a0 + a2
            b1, b3 = a1 - a3, a1 + a3
            b4, b6 = a4 - a6, a4 + a6
            b5, b7 = a5 - a7, a5 + a7
            values[(0 + i) * LANES + lane] = quantise(share * (b0 - b4), rounding)
            values[(3 + i) * LANES + lane] = quantise(share * (b1 - b5), rounding)
            values[(6 + i) * LANES + lane] = quantise(share * (b2 - b6), rounding)
            values[(9 + i) * LANES + lane] = quantise(share * (b3 - b7), rounding)
            values[(12 + i) * LANES + lane] = quantise(share * (b0 + b4), rounding)
            values[(15 + i) * LANES + lane] = quantise(share * (b1 + b5), rounding)
            values[(18 + i) * LANES + lane] = quantise(share * (b2 + b6), rounding)
            values[(21 + i) * LANES + lane] = quantise(share * (b3 + b7), rounding)
