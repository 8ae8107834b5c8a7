"""The block length, and the one set of compiler options and the one cache that all kernels share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
from numba import types
from numba.extending import intrinsic

from fragfield_base.kernel_cache import compiled_with, digest_of

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["LANES", "block_kernel", "inlined_kernel", "kernel", "lane_function", "parallel_kernel", "widest_vectors"]

LANES = 16
"""Cells per block: two AVX-512 vectors of doubles, four AVX2 ones. Loops over 8 would be unrolled, not vectorised."""

# Sums keep their order and NaN stays visible. Nor may products be fused with sums ("contract"): where the compiler
# does so depends on how it inlines, so that code just compiled and code from the cache would round differently.
_OPTIONS: dict[str, Any] = {"fastmath": {"nsz"}, "error_model": "numpy", "nogil": True}


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
    return compiled_with(numba, function, _nrt=False, forceinline=True, **_OPTIONS)


def lane_function(function: Callable[..., Any]) -> Any:
    """Compile `function` of one lane's numbers into what calls it, so that the loop over the lanes is vectorised."""
    return compiled_with(numba, function, _nrt=False, forceinline=True, **_OPTIONS)


def parallel_kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` with its `prange` loops shared by threads."""
    return _compile(function, parallel=True)


@intrinsic
def widest_vectors(typing_context: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Have the compiler use 512-bit vectors, where there are any, in the kernel that calls this.

    By default it keeps to 256 bits on processors that once slowed down for more. What does not fit into the registers
    goes to the stack, which is aligned to cache lines here: vectors that straddle two lines cost more.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        # Straight into the set: llvmlite's own `add` knows no attributes of one kind of processor.
        for attribute in ('"prefer-vector-width"="512"', '"stackrealign"'):
            set.add(builder.function.attributes, attribute)
        return context.get_dummy_value()

    return types.none(), generate


def _compile(function: Callable[..., Any], **options: bool) -> Any:
    name = f"burst-{_sources_of(function.__module__)}"
    return compiled_with(numba, function, name, **_OPTIONS, **options)


def _sources_of(module: str) -> str:
    """Digest of what a kernel of the module may call: the axisymmetric ones call the others, not the reverse."""
    return _AXISYMMETRIC_SOURCES if ".axisymmetric." in module else _SOURCES


def _files(*, axisymmetric: bool) -> list[Path]:
    package = Path(__file__).resolve().parent.parent
    return [
        package / "mechanics" / "detonation.py",
        *(package / "materials").glob("*.py"),
        *(path for path in (package / "kernels").rglob("*.py") if axisymmetric or path.parent.name != "axisymmetric"),
    ]


_SOURCES = digest_of(_files(axisymmetric=False))
_AXISYMMETRIC_SOURCES = digest_of(_files(axisymmetric=True))
