"""The block length, and the one set of compiler options and the one cache that all kernels share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
from numba import types
from numba.extending import intrinsic, register_jitable

from burst_fenicsx.materials import registered_files
from fragfield_base.kernel_cache import compiled_with, digest_of
from fragfield_base.kernel_pipeline import LinkedCompiler

if TYPE_CHECKING:
    from collections.abc import Callable


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


def addressed_kernel(function: Callable[..., Any]) -> Any:
    """Compile a block kernel that is called by its address alone (see `threads`): Python's arguments are not read."""
    return _compile(function, _nrt=False, no_cpython_wrapper=True)


def inlined_kernel(function: Callable[..., Any]) -> Any:
    """Compile a block kernel into what calls it: to hand over all arrays of a state costs as much as its forces."""
    return lane_function(function)


def lane_function(function: Callable[..., Any]) -> Any:
    """Compile `function` of one lane's numbers into what calls it, so that the loop over the lanes is vectorised."""
    return compiled_with(numba, function, _nrt=False, forceinline=True, **_OPTIONS)


def plain_or_lane_function(function: Callable[..., Any]) -> Any:
    """As `lane_function` within kernels; called from Python, with arrays for numbers, it is not compiled."""
    return register_jitable(_nrt=False, forceinline=True, pipeline_class=LinkedCompiler, **_OPTIONS)(function)


def parallel_kernel(function: Callable[..., Any]) -> Any:
    """Compile `function` with its `prange` loops shared by threads."""
    return _compile(function, parallel=True)


def chosen(kernels: list[Any], column: int) -> Any:
    """Block kernel that calls the one of a law: its number stands in a column of the parameters, the first argument."""
    *first, last = kernels
    for number in reversed(range(len(first))):
        last = _chosen(number, column, first[number], last)
    return last


def _chosen(number: int, column: int, this: Any, others: Any) -> Any:
    @block_kernel
    def choose(parameters: Any, *arguments: Any) -> Any:
        if parameters[column] == number:
            return this(parameters, *arguments)
        return others(parameters, *arguments)

    return choose


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
    return compiled_with(numba, function, _FOLDER, **_OPTIONS, **options)


_PACKAGE = Path(__file__).resolve().parent.parent
_SOURCES = [path for folder in ("kernels", "materials") for path in (_PACKAGE / folder).rglob("*.py")]
_FOLDER = f"burst-{digest_of([_PACKAGE / 'mechanics' / 'detonation.py', *_SOURCES, *registered_files()])}"
"""Of the cache: what a kernel may call is in these files."""
