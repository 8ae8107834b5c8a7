"""A plugin of pytest under which kernels run as plain Python (NUMBA_DISABLE_JIT=1): a fault then costs no compilation.

Numba's intrinsics have no meaning there: they get one here. Sums may round differently, and numbers that Python refuses
(a root below zero) are errors; which tests pass all the same is found without a fault.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numba.core.extending import _Intrinsic  # no public name leads there

__all__ = ["pytest_configure"]


def _address(array: np.ndarray) -> np.uint64:
    return np.uint64(array.ctypes.data)


def _read(place: np.uint64) -> np.float64:
    return np.float64(ctypes.c_double.from_address(int(place)).value)


def _write(place: np.uint64, value: float) -> None:
    ctypes.c_double.from_address(int(place)).value = value


_PLAIN = {
    "address": _address,
    "_read": _read,
    "_write": _write,
    "fma": lambda a, b, c: a * b + c,
    "widest_vectors": lambda: None,
}


def _call(intrinsic: Any, *arguments: Any) -> Any:
    return _PLAIN[intrinsic._name](*arguments)


def pytest_configure(config: Any) -> None:
    """Give the intrinsics a meaning; divide by zero as compiled kernels do, without a warning."""
    _Intrinsic.__call__ = _call
    np.seterr(all="ignore")
