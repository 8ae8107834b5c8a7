"""The block length, and the one set of compiler options and the one cache that all kernels share."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
from numba import types
from numba.extending import intrinsic

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["LANES", "block_kernel", "inlined_kernel", "kernel", "lane_function", "parallel_kernel", "widest_vectors"]

LANES = 16
"""Cells per block: two AVX-512 vectors of doubles, four AVX2 ones. Loops over 8 would be unrolled, not vectorised."""

# Sums keep their order and NaN stays visible. Nor may products be fused with sums ("contract"): where the compiler
# does so hangs on how it inlines, so that code just compiled and code from the cache would round differently.
_FAST_MATH = {"nsz"}


def kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` for one thread."""
    return _compile(function)


def block_kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` for one thread, without counting references to arrays: that costs more than a block's sums.

    Such a kernel may slice the arrays that it is given, but neither allocate nor return one.
    """
    return _compile(function, _nrt=False)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Compile a block kernel into what calls it: to hand over all arrays of a state costs as much as its forces."""
    return _compile(function, _nrt=False, forceinline=True)


def lane_function(function: Callable[..., Any]) -> Any:
    """Compile `function` of one lane's numbers into what calls it, so that the loop over the lanes is vectorised."""
    return _compile(function, _nrt=False, forceinline=True)


def parallel_kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` with its `prange` loops shared by threads."""
    return _compile(function, parallel=True)


@intrinsic
def widest_vectors(typing_context: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Have the compiler use 512-bit vectors, where there are any, in the kernel that calls this.

    By default it keeps to 256 bits on processors that once slowed down for more.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        # Straight into the set: llvmlite's own `add` knows no attributes of one kind of processor.
        set.add(builder.function.attributes, '"prefer-vector-width"="512"')
        return context.get_dummy_value()

    return types.none(), generate


def _compile(function: Callable[..., Any], **options: bool) -> Any:
    """Compile with a cache folder of its own for this state of all kernels' sources.

    Numba's cache looks at the source file of a kernel alone, and would keep code that calls kernels since changed
    elsewhere. Where the cache lies is settled while the decorator runs.
    """
    usual = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = str(Path(usual or _user_cache()) / f"burst-{_sources_of(function.__module__)}")
    try:
        return numba.njit(cache=True, fastmath=_FAST_MATH, error_model="numpy", nogil=True, **options)(function)
    finally:
        numba.config.CACHE_DIR = usual


def _user_cache() -> Path:
    """The user's cache folder, or a temporary one where it cannot be written."""
    folder = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "fragfield"
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return Path(tempfile.gettempdir()) / f"fragfield-{os.getuid()}"
    return folder if os.access(folder, os.W_OK) else Path(tempfile.gettempdir()) / f"fragfield-{os.getuid()}"


def _digest_of_sources(*folders: str) -> str:
    package = Path(__file__).resolve().parent.parent
    files = [package / "detonation.py", *(path for folder in folders for path in (package / folder).glob("*.py"))]
    return hashlib.sha256(b"".join(path.read_bytes() for path in sorted(files))).hexdigest()[:16]


def _sources_of(module: str) -> str:
    """Digest of what a kernel of the module may call: the axisymmetric ones call the others, not the reverse."""
    return _AXISYMMETRIC_SOURCES if ".axisymmetric." in module else _SOURCES


_SOURCES = _digest_of_sources("kernels", "materials")
_AXISYMMETRIC_SOURCES = _digest_of_sources("kernels", "materials", "kernels/axisymmetric")
