"""The block length and the one set of compiler options that all kernels share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numba

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["LANES", "kernel", "parallel_kernel"]

LANES = 16
"""Cells per block: two AVX-512 vectors of doubles, four AVX2 ones."""

# Contraction to fused multiply-add only: sums keep their order and NaN stays visible.
_FAST_MATH = {"contract", "nsz"}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` for one thread."""
    return numba.njit(cache=True, fastmath=_FAST_MATH, error_model="numpy", nogil=True)(function)


def parallel_kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` with its `prange` loops shared by threads."""
    return numba.njit(cache=True, fastmath=_FAST_MATH, error_model="numpy", nogil=True, parallel=True)(function)
