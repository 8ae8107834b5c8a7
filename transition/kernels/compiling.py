"""Compiled kernels with a cache that knows all of their sources and belongs to the user alone."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba

from fragfield_base.kernel_cache import compiled_with, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["kernel"]

_STAMP = digest_of(Path(__file__).parent.glob("*.py"))


def kernel(function: Callable[..., Any]) -> Any:  # noqa: ANN401 - numba's dispatcher has no type
    """Compile a function for one thread and without the interpreter's lock."""
    return compiled_with(numba, function, f"transition-{_STAMP}", nogil=True, error_model="numpy")
