"""Compiled kernels with a per-user cache that is invalidated by a change of any of their sources."""

from __future__ import annotations

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba

from fragfield_base.kernel_cache import compiled_with, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["inner_kernel", "kernel"]

_STAMP = digest_of(Path(__file__).parent.glob("*.py"))


def kernel(function: Callable[..., Any]) -> Any:  # noqa: ANN401 - numba's dispatcher has no type
    """Compile a function that is called from Python, for one thread and without the interpreter's lock."""
    return compiled_with(numba, function, f"flight-{_STAMP}", nogil=True, error_model="numpy")


def inner_kernel(**options: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compile a function that other kernels call, with these options of numba.njit.

    Arrays that it looks at are not counted as in use, so that it can make none: one that does says `_nrt=True`.
    """
    return partial(compiled_with, numba, error_model="numpy", **{"_nrt": False, **options})
