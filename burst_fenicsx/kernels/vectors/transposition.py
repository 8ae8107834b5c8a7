"""Addresses of arrays, and what lies there brought near before it is needed."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

if TYPE_CHECKING:
    from collections.abc import Callable


@intrinsic
def address(typing_context: Any, array: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Address of the first number of an array of doubles, or of nodes' numbers, that lie without gaps.

    Raises
    ------
    numba.TypingError
        The array is another one: its numbers would be read as what they are not.
    """
    if array.dtype not in (types.float64, types.int32) or array.layout != "C":
        raise TypingError(f"vectors lie as float64 without gaps here, not as {array}")

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = context.make_array(signature.args[0])(context, builder, arguments[0]).data
        return builder.ptrtoint(data, ir.IntType(64))

    return types.uint64(array), generate


@intrinsic
def prefetch(typing_context: Any, place: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Bring the cache line at an address near, for reading and writing soon."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        pointer, index = builder.inttoptr(arguments[0], ir.IntType(8).as_pointer()), ir.IntType(32)
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, index, index, index])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        builder.call(function, [pointer, index(0), index(3), index(1)])
        return context.get_dummy_value()

    return types.none(types.uint64), generate
