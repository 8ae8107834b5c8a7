"""The trilinear hexahedron in modal form.

The eight nodal values of a field are replaced by their Walsh transform: the sums over the nodes
with the signs 1, xi, eta, zeta and their products. Node n of a cell sits at xi = +-1 by bit 0 of n,
eta by bit 1, zeta by bit 2 (the tensor-product order of dolfinx), and mode m likewise is the product
of the coordinates whose bits are set: 1 = xi, 2 = eta, 3 = xi eta, 4 = zeta, 5 = xi zeta,
6 = eta zeta, 7 = xi eta zeta.

In this form the mean gradient of Flanagan and Belytschko (1981) needs six pairs of cross
products, and the hourglass modes are simply modes 3, 5, 6 and 7. With x = sum of coefficients
times modes, the derivative of the cell's volume by the place of node a is

    b_a = xi P + eta Q + zeta R + xi eta S3 + xi zeta S5 + eta zeta S6     (signs taken at a),

exactly (the integral of the shape function's gradient over the cell).

A cell's modes are a tuple of the vectors of modes 1 to 7 (mode 0, the sum, plays no part) and its mean gradient is
the tuple (P, Q, S3, R, S5, S6), which belong to modes 1 to 6.
"""

from __future__ import annotations

from typing import TypeAlias

import numpy as np

from burst_fenicsx.kernels.cells import layout as at
from burst_fenicsx.kernels.lanes import LANES, block_kernel, kernel, lane_function, widest_vectors
from burst_fenicsx.kernels.vectors.tensors import (
    Vector,
    add_cross,
    add_outer,
    add_scaled,
    cross,
    dot,
    fma,
    load_vector,
    outer,
    scaled,
    store_vector,
)

Modes: TypeAlias = tuple[Vector, Vector, Vector, Vector, Vector, Vector, Vector]
Component: TypeAlias = tuple[float, float, float, float, float, float, float]
Gradient: TypeAlias = tuple[Vector, Vector, Vector, Vector, Vector, Vector]

PER_CELL = 1.0 / 64.0
"""A cell's volume and mean gradient over those of its modes by `cell_gradient`."""

_THIRD = 1.0 / 3.0


@lane_function
def component_modes(rows: np.ndarray, row: int, lane: int) -> Component:
    """Modes 1 to 7 of a component of a nodal vector field, whose value at node n stands in the row `row` + 3 n."""
    a, b = rows[row * LANES + lane], rows[(row + 3) * LANES + lane]
    c, d = rows[(row + 6) * LANES + lane], rows[(row + 9) * LANES + lane]
    e, f = rows[(row + 12) * LANES + lane], rows[(row + 15) * LANES + lane]
    g, h = rows[(row + 18) * LANES + lane], rows[(row + 21) * LANES + lane]
    a, b, c, d, e, f, g, h = a + b, b - a, c + d, d - c, e + f, f - e, g + h, h - g
    a, b, c, d, e, f, g, h = a + c, b + d, c - a, d - b, e + g, f + h, g - e, h - f
    return b + f, c + g, d + h, e - a, f - b, g - c, h - d


@lane_function
def cell_modes(x: Component, y: Component, z: Component) -> Modes:
    """Modes 1 to 7 of a nodal vector field, from those of its components."""
    return (
        (x[0], y[0], z[0]),
        (x[1], y[1], z[1]),
        (x[2], y[2], z[2]),
        (x[3], y[3], z[3]),
        (x[4], y[4], z[4]),
        (x[5], y[5], z[5]),
        (x[6], y[6], z[6]),
    )


@block_kernel
def nodes_to_modes(scratch: np.ndarray) -> None:
    """Put the modes of positions and velocities in place of their nodal values, in rows 3 m + i for mode m."""
    widest_vectors()
    for row in (at.POSITION, at.POSITION + 1, at.POSITION + 2, at.VELOCITY, at.VELOCITY + 1, at.VELOCITY + 2):
        for lane in range(LANES):
            modes = component_modes(scratch, row, lane)
            scratch[(row + 3) * LANES + lane], scratch[(row + 6) * LANES + lane] = modes[0], modes[1]
            scratch[(row + 9) * LANES + lane], scratch[(row + 12) * LANES + lane] = modes[2], modes[3]
            scratch[(row + 15) * LANES + lane], scratch[(row + 18) * LANES + lane] = modes[4], modes[5]
            scratch[(row + 21) * LANES + lane] = modes[6]


@lane_function
def load_modes(scratch: np.ndarray, row: int, lane: int) -> Modes:
    """Modes 1 to 7 of a vector field that `nodes_to_modes` has put in the rows from `row` on."""
    return (
        load_vector(scratch, row + 3, lane),
        load_vector(scratch, row + 6, lane),
        load_vector(scratch, row + 9, lane),
        load_vector(scratch, row + 12, lane),
        load_vector(scratch, row + 15, lane),
        load_vector(scratch, row + 18, lane),
        load_vector(scratch, row + 21, lane),
    )


@lane_function
def modes_earlier(now: Modes, back: float, rate: Modes) -> Modes:
    """Modes at the time `back` (s, negative) from now, of modes that change at a `rate`."""
    return (
        add_scaled(now[0], back, rate[0]),
        add_scaled(now[1], back, rate[1]),
        add_scaled(now[2], back, rate[2]),
        add_scaled(now[3], back, rate[3]),
        add_scaled(now[4], back, rate[4]),
        add_scaled(now[5], back, rate[5]),
        add_scaled(now[6], back, rate[6]),
    )


@lane_function
def cell_gradient(modes: Modes) -> tuple[Gradient, float]:
    """Derivative of the cell's volume by its nodes' places, in modal form (m2), and the volume (m3).

    `modes` are those of the positions (m). Both results are 64 times as large, since modes are eight times the
    coefficients: `PER_CELL` takes it back, where it does not cancel.

    Notes
    -----
    Flanagan and Belytschko (1981), Eq. 15-21, rewritten for the coefficients a, b, c of xi, eta, zeta,
    d, e, f of eta zeta, xi zeta, xi eta (and g of xi eta zeta):
    P = b x c + f x e / 3, Q = c x a + d x f / 3, R = a x b + e x d / 3,
    S3 = (b x d + e x a) / 3 and so on by cycling. f x g / 3 in P's eta part cancels g x f / 3 in Q's xi part;
    so do the other two pairs, and g drops out. The volume is a . (b x c) and a third of a . (f x e), d . (f x b) and
    d . (c x e): the first two make a . P, the others d . S6.
    """
    a, b, f, c, e, d, _ = modes
    d3, e3, f3 = scaled(_THIRD, d), scaled(_THIRD, e), scaled(_THIRD, f)
    p = add_cross(cross(b, c), f3, e)
    q = add_cross(cross(c, a), d3, f)
    r = add_cross(cross(a, b), e3, d)
    s3 = add_cross(cross(b, d3), e3, a)
    s5 = add_cross(cross(d3, c), a, f3)
    s6 = add_cross(cross(c, e3), f3, b)
    volume = dot(a, p) + dot(d, s6)
    return (p, q, s3, r, s5, s6), volume


@lane_function
def squared_gradients(gradient: Gradient) -> tuple[Vector, float]:
    """An eighth of the sums of b_i^2 over the nodes (m4), and of a bound on the largest eigenvalue of b_a b_a^T.

    `gradient` is the cell's; of `cell_gradient`'s, 64^2 times as much.

    The highest frequency of the one-point cell with lumped mass is omega^2 = 8 c^2 lambda / V^2 with lambda the
    largest eigenvalue of the sum of b_a b_a^T over the nodes (Flanagan and Belytschko 1981, Eq. 63). It is bounded
    from above by trace/3 + sqrt(2/3) |deviator|, which is exact for cubes and for flat cells.
    """
    total = outer(gradient[0], gradient[0])
    total = add_outer(total, gradient[1], gradient[1])
    total = add_outer(total, gradient[2], gradient[2])
    total = add_outer(total, gradient[3], gradient[3])
    total = add_outer(total, gradient[4], gradient[4])
    (xx, xy, zx), (_, yy, yz), (_, _, zz) = add_outer(total, gradient[5], gradient[5])
    mean = (xx + yy + zz) * _THIRD
    diagonal = (xx - mean, yy - mean, zz - mean)
    side = (xy, yz, zx)
    deviator = fma(2.0, dot(side, side), dot(diagonal, diagonal))
    return (xx, yy, zz), mean + np.sqrt(deviator * (2.0 / 3.0))


@lane_function
def _store_component(
    f1: float,
    f2: float,
    f3: float,
    f4: float,
    f5: float,
    f6: float,
    f7: float,
    fraction: float,
    rounding: float,
    scratch: np.ndarray,
    row: int,
    lane: int,
) -> None:
    """Sum of the modes at the nodes: f_n = fraction times the sum over m of sign(m, n) F_m, rounded."""
    a2, a3 = f2 - f3, f2 + f3
    a4, a5 = f4 - f5, f4 + f5
    a6, a7 = f6 - f7, f6 + f7
    b0, b2 = -f1 - a2, a2 - f1
    b1, b3 = f1 - a3, f1 + a3
    b4, b6 = a4 - a6, a4 + a6
    b5, b7 = a5 - a7, a5 + a7
    # The fraction is a power of two, so its product is exact and rounding by one fused sum the same as `quantise`.
    scratch[row * LANES + lane] = fma(fraction, b0 - b4, rounding) - rounding
    scratch[(row + 3) * LANES + lane] = fma(fraction, b1 - b5, rounding) - rounding
    scratch[(row + 6) * LANES + lane] = fma(fraction, b2 - b6, rounding) - rounding
    scratch[(row + 9) * LANES + lane] = fma(fraction, b3 - b7, rounding) - rounding
    scratch[(row + 12) * LANES + lane] = fma(fraction, b0 + b4, rounding) - rounding
    scratch[(row + 15) * LANES + lane] = fma(fraction, b1 + b5, rounding) - rounding
    scratch[(row + 18) * LANES + lane] = fma(fraction, b2 + b6, rounding) - rounding
    scratch[(row + 21) * LANES + lane] = fma(fraction, b3 + b7, rounding) - rounding


@lane_function
def store_nodal_forces(
    modes: Modes, fraction: float, rounding: float, scratch: np.ndarray, row: int, lane: int
) -> None:
    """Transform the modes of the nodal forces (N) back, times `fraction`, rounded, 3 n + i for node n, to 24 rows.

    The transform is its own inverse times 8. `rounding` is the constant of `exact.quantise`.
    """
    f1, f2, f3, f4, f5, f6, f7 = modes
    _store_component(f1[0], f2[0], f3[0], f4[0], f5[0], f6[0], f7[0], fraction, rounding, scratch, row, lane)
    _store_component(f1[1], f2[1], f3[1], f4[1], f5[1], f6[1], f7[1], fraction, rounding, scratch, row + 1, lane)
    _store_component(f1[2], f2[2], f3[2], f4[2], f5[2], f6[2], f7[2], fraction, rounding, scratch, row + 2, lane)


@kernel
def hexahedron_volumes(position: np.ndarray, dofmap: np.ndarray) -> np.ndarray:
    """Exact volume of each trilinear cell (cells,) in m3; `position` (nodes, 3) m, `dofmap` (cells, 8) int32."""
    volumes, values = np.empty(dofmap.shape[0]), np.zeros(24 * LANES)
    for cell in range(dofmap.shape[0]):
        for n in range(8):
            for i in range(3):
                values[(3 * n + i) * LANES] = position[dofmap[cell, n], i]
        x, y, z = component_modes(values, 0, 0), component_modes(values, 1, 0), component_modes(values, 2, 0)
        _, whole = cell_gradient(cell_modes(x, y, z))
        volumes[cell] = PER_CELL * whole
    return volumes


@lane_function
def store_gradient(gradient: Gradient, scratch: np.ndarray, row: int, lane: int) -> None:
    """Put a gradient in 18 rows from `row` on."""
    p, q, s3, r, s5, s6 = gradient
    store_vector(p, scratch, row, lane)
    store_vector(q, scratch, row + 3, lane)
    store_vector(s3, scratch, row + 6, lane)
    store_vector(r, scratch, row + 9, lane)
    store_vector(s5, scratch, row + 12, lane)
    store_vector(s6, scratch, row + 15, lane)


@lane_function
def load_gradient(scratch: np.ndarray, row: int, lane: int) -> Gradient:
    """Take a gradient from 18 rows from `row` on."""
    return (
        load_vector(scratch, row, lane),
        load_vector(scratch, row + 3, lane),
        load_vector(scratch, row + 6, lane),
        load_vector(scratch, row + 9, lane),
        load_vector(scratch, row + 12, lane),
        load_vector(scratch, row + 15, lane),
    )
