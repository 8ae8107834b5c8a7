"""Piecewise cubics, the form in which air, wind and drag are passed to the kernels.

Monotone-safe: between two entries an interpolated value never leaves the interval they span.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray


def monotone_slopes(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Slopes of the shape-preserving cubic through (x, y), shapes (n,).

    Weighted harmonic mean inside (Fritsch and Butland 1984), limited three-point formula at the ends (Moler 2004,
    section 3.4), so that the cubic has no extremum that the entries lack.
    """
    if x.size == 1:
        return np.zeros(1)
    step = np.diff(x)
    secant = np.diff(y) / step
    if x.size == 2:
        return np.array([secant[0], secant[0]])
    slope = np.zeros_like(y)
    left, right = 2.0 * step[1:] + step[:-1], step[1:] + 2.0 * step[:-1]
    same_sign = secant[:-1] * secant[1:] > 0.0
    before, after = secant[:-1][same_sign], secant[1:][same_sign]
    weight_before, weight_after = left[same_sign], right[same_sign]
    slope[1:-1][same_sign] = (weight_before + weight_after) / (weight_before / before + weight_after / after)
    slope[0] = _end_slope(step[0], step[1], secant[0], secant[1])
    slope[-1] = _end_slope(step[-1], step[-2], secant[-1], secant[-2])
    return slope


def _end_slope(near: float, far: float, near_secant: float, far_secant: float) -> float:
    slope = ((2.0 * near + far) * near_secant - near * far_secant) / (near + far)
    if slope * near_secant <= 0.0:
        return 0.0
    if near_secant * far_secant <= 0.0 and abs(slope) > 3.0 * abs(near_secant):
        return 3.0 * near_secant
    return slope


def hermite_pieces(
    x: NDArray[np.float64],
    y: NDArray[np.float64],
    slope_after: NDArray[np.float64],
    slope_before: NDArray[np.float64],
) -> NDArray[np.float64]:
    """Coefficients (n-1, 4) of the cubics with the values y at x and one-sided slopes, in powers of (x - x[i]).

    `slope_after[i]` is the slope just after x[i], `slope_before[i]` the one just before it: they differ at a kink.
    """
    step = np.diff(x)
    secant = np.diff(y) / step
    first, last = slope_after[:-1], slope_before[1:]
    return np.stack(
        [y[:-1], first, (3.0 * secant - 2.0 * first - last) / step, (first + last - 2.0 * secant) / step**2], axis=1
    )


def monotone_pieces(x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
    """Coefficients (n-1, 4) of the shape-preserving cubic through (x, y); one constant piece for a single entry."""
    if x.size == 1:
        return np.array([[y[0], 0.0, 0.0, 0.0]])
    slope = monotone_slopes(x, y)
    return hermite_pieces(x, y, slope, slope)


def evaluate_pieces(
    x: NDArray[np.float64], pieces: NDArray[np.float64], at: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Values at the positions `at`, constant beyond the first and the last entry of x."""
    position = np.clip(at, x[0], x[-1])
    index = np.clip(np.searchsorted(x, position, side="right") - 1, 0, len(pieces) - 1)
    offset = position - x[index]
    c0, c1, c2, c3 = pieces[index].T
    return np.asarray(c0 + offset * (c1 + offset * (c2 + offset * c3)))
