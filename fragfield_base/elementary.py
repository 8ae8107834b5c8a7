"""Elementary functions of arrays by the C library: numpy's own differ in their last bits between processors.

A burst amplifies a last bit until other cells tear, and a break-up puts other fragments elsewhere: what leads to them
is computed by these. Between processors with fused multiplication (AVX2 and newer) they are the same to the last bit.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray


def _by_element(function: Callable[..., float], arguments: int = 1) -> Callable[..., NDArray[np.float64]]:
    elements = np.frompyfunc(function, arguments, 1)

    def of_arrays(*values: ArrayLike) -> NDArray[np.float64]:
        return np.asarray(elements(*values), dtype=np.float64)

    return of_arrays


arctan2 = _by_element(math.atan2, 2)
cbrt = _by_element(math.cbrt)
cos = _by_element(math.cos)
exp = _by_element(math.exp)
power = _by_element(math.pow, 2)
sin = _by_element(math.sin)
