"""Sums that come out bitwise the same in any order: of cells, chunks, colours, threads and ranks.

Every term is first rounded to a multiple of one power of two, the quantum. Sums of such multiples are exact in double
precision as long as they stay below 2^53 quanta, so their order cannot matter (Demmel and Nguyen 2015, IEEE
Transactions on Computers 64, with one bin). The rounding takes one addition and one subtraction of a constant,
1.5 * 2^52 quanta, near which doubles stand one quantum apart. A compiler that reorders sums would undo it; the options
of `lanes` do not allow that.
"""

from __future__ import annotations

import math

import numpy as np

from burst_fenicsx.kernels.lanes import LANES, lane_function, plain_or_lane_function


def rounding_constant(largest: float) -> float:
    """Constant with which `quantise` rounds terms of up to `largest`; sums of up to 4 `largest` are exact then.

    The error of a term is at most `largest` / 2^51. Beyond the limits nothing breaks but the independence of the order.

    Raises
    ------
    ValueError
        `largest` is not positive and finite.
    """
    if not (largest > 0.0 and math.isfinite(largest)):
        raise ValueError(f"the largest term is {largest}; it must be positive and finite")
    # Terms of up to 2^51 quanta keep the sum with the constant where doubles stand one quantum apart.
    return math.ldexp(1.5, math.frexp(largest)[1] + 1)


def quantum(rounding: float) -> float:
    """Power of two of which everything rounded with the constant `rounding` is a multiple."""
    return math.ldexp(rounding / 1.5, -52)


@plain_or_lane_function
def quantise(value: float, rounding: float) -> float:
    """Round `value`, a number or an array, to a multiple of the quantum that belongs to the constant `rounding`."""
    return (value + rounding) - rounding


@lane_function
def row_sum(rows: np.ndarray, row: int) -> float:
    """Sum of a row of rounded numbers, exact in any order: here by vectors."""
    a, b, c, d = 0.0, 0.0, 0.0, 0.0
    for lane in range(row * LANES, (row + 1) * LANES, 4):
        a, b, c, d = a + rows[lane], b + rows[lane + 1], c + rows[lane + 2], d + rows[lane + 3]
    return (a + c) + (b + d)
