"""Compiled kernels with a cache that knows all of their sources."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["kernel"]

_HERE = Path(__file__).parent
_STAMP = hashlib.sha256(b"".join(path.read_bytes() for path in sorted(_HERE.glob("*.py")))).hexdigest()[:16]


def kernel(function: Callable[..., Any]) -> Any:  # noqa: ANN401 - numba's dispatcher has no type
    """Compile a function that is called from Python, for one thread and without the interpreter's lock.

    Numba's cache looks at the function's own file only and would keep code that calls kernels since changed elsewhere,
    so it gets a folder for this state of all sources. Where it lies is settled while the decorator runs.
    """
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(Path(usual or _HERE / "__pycache__") / f"flight-{_STAMP}")
    try:
        return numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    except RuntimeError:  # no folder that may be written to
        return numba.njit(nogil=True, error_model="numpy")(function)
    finally:
        numba.config.CACHE_DIR = usual
