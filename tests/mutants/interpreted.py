"""A plugin of pytest under which kernels run as plain Python (NUMBA_DISABLE_JIT=1): a fault then costs no compilation.

Numba's intrinsics have no meaning there: they get one here. Sums may round differently, and numbers that Python refuses
(a root below zero) are errors; which tests pass all the same is found without a fault.
"""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np
from numba.core.extending import _Intrinsic  # no public name leads there

from burst_fenicsx.kernels.lanes import LANES

__all__ = ["pytest_configure"]


def _address(array: np.ndarray) -> np.uint64:
    return np.uint64(array.ctypes.data)


def _triples(places: tuple[np.uint64, ...]) -> list[Any]:
    return [(ctypes.c_double * 3).from_address(int(place)) for place in places]


def _load_triples(places: tuple[np.uint64, ...], rows: np.ndarray, start: int) -> None:
    for k, triple in enumerate(_triples(places)):
        rows[start + k : start + k + 3 * LANES : LANES] = triple


def _store_triples(rows: np.ndarray, start: int, places: tuple[np.uint64, ...]) -> None:
    for k, triple in enumerate(_triples(places)):
        triple[:] = rows[start + k : start + k + 3 * LANES : LANES].tolist()


def _add_triples(rows: np.ndarray, start: int, places: tuple[np.uint64, ...]) -> None:
    for k, triple in enumerate(_triples(places)):
        for i in range(3):
            triple[i] += float(rows[start + k + i * LANES])


_PLAIN = {
    "address": _address,
    "prefetch": lambda _place: None,
    "load_triples": _load_triples,
    "store_triples": _store_triples,
    "add_triples": _add_triples,
    "fma": lambda a, b, c: a * b + c,
    "widest_vectors": lambda: None,
}


def _call(intrinsic: Any, *arguments: Any) -> Any:
    return _PLAIN[intrinsic._name](*arguments)


def pytest_configure(config: Any) -> None:
    """Give the intrinsics a meaning; divide by zero as compiled kernels do, without a warning."""
    _Intrinsic.__call__ = _call
    np.seterr(all="ignore")
