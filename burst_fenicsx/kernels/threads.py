"""Loops shared by threads, of which the compiler sees the body once.

A `prange` loop of numba compiles its body, and all that is called there, three times: with the loop, in the function
that the threads call, and in what hands this function its arguments. Here the body is a kernel like any other, and one
loop, the same for all, calls it by its address.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from burst_fenicsx.kernels.lanes import parallel_kernel

if TYPE_CHECKING:
    from collections.abc import Callable

# Of a piece as the loop calls it: from where to where it goes, and where its other arguments stand.
_ARGUMENTS = types.intp, types.intp, types.voidptr


@intrinsic
def _call(
    typing_context: Any,  # noqa: ARG001
    code: Any,  # noqa: ARG001
    first: Any,  # noqa: ARG001
    last: Any,  # noqa: ARG001
    data: Any,  # noqa: ARG001
) -> tuple[Any, Callable[..., Any]]:

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        kind = context.call_conv.get_function_type(types.none, _ARGUMENTS)
        status = [cgutils.alloca_once(builder, argument.pointee) for argument in kind.args[:2]]
        code, first, last, data = arguments
        data = builder.inttoptr(data, context.get_value_type(types.voidptr))
        builder.call(builder.inttoptr(code, kind.as_pointer()), [*status, first, last, data])
        return context.get_dummy_value()

    return types.none(types.uint64, types.intp, types.intp, types.uint64), generate


@parallel_kernel
def _loop(threads: int, count: int, code: np.uint64, data: np.uint64) -> None:
    for number in numba.prange(threads):
        thread = np.int64(number)
        _call(code, thread * count // threads, (thread + 1) * count // threads, data)


def address_of(function: Any, arguments: tuple[Any, ...]) -> np.uint64:
    """Address of a kernel's machine code for arguments of the types of these; it is compiled where it has to be."""
    signature = tuple(numba.typeof(argument) for argument in arguments)
    dispatcher = function.compiled
    dispatcher.compile(signature)
    compiled = dispatcher.overloads[signature]
    return np.uint64(compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name))


@intrinsic
def call_at(typing_context: Any, code: Any, arguments: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Call the kernel whose `address_of` arguments of just these types is `code`; it may neither raise nor return.

    A large kernel that is linked to its callers instead is compiled again with each of them.
    """

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:
        kinds = signature.args[1].types
        kind = context.call_conv.get_function_type(types.none, kinds)
        status = [cgutils.alloca_once(builder, argument.pointee) for argument in kind.args[:2]]
        given = context.get_arg_packer(kinds).as_arguments(builder, cgutils.unpack_tuple(builder, values[1]))
        builder.call(builder.inttoptr(values[0], kind.as_pointer()), [*status, *given])
        return context.get_dummy_value()

    return types.none(types.uint64, arguments), generate


@intrinsic
def on_threads(
    typing_context: Any,
    count: Any,  # noqa: ARG001
    piece: Any,
    arguments: Any,
) -> tuple[Any, Callable[..., Any]]:
    """Call the kernel `piece(first, last, *arguments)`, each of numba's threads for its part of a range of `count`.

    A piece may not raise: what it raises is lost.
    """
    called = piece.get_call_type(typing_context, (types.intp, types.intp, *arguments.types), {})
    loop = typing_context.resolve_value_type(_loop)
    loop_signature = loop.get_call_type(typing_context, (types.intp, types.intp, types.uint64, types.uint64), {})

    def generate(context: Any, builder: Any, signature: Any, values: Any) -> Any:  # noqa: ARG001
        number, _, packed = values
        kind = context.call_conv.get_function_type(types.none, _ARGUMENTS)
        function = ir.Function(builder.module, kind, builder.module.get_unique_name(f"{builder.function.name}.piece"))
        function.linkage = "internal"
        inner = ir.IRBuilder(function.append_basic_block())
        first, last, data = context.call_conv.get_arguments(function)
        given = cgutils.unpack_tuple(inner, inner.load(inner.bitcast(data, packed.type.as_pointer())))
        cast = [
            context.cast(inner, value, kind_given, kind_taken)
            for value, kind_given, kind_taken in zip(
                (first, last, *given), (types.intp, types.intp, *arguments.types), called.args, strict=True
            )
        ]
        _linked(context, piece, called)(inner, cast)
        context.call_conv.return_value(inner, context.get_dummy_value())
        places = function, cgutils.alloca_once_value(builder, packed)
        addresses = [builder.ptrtoint(place, ir.IntType(64)) for place in places]
        # Numba's own function for kernels calls this one by an address, with which no kernel can be kept.
        threads = cgutils.get_or_insert_function(builder.module, ir.FunctionType(number.type, []), "get_num_threads")
        _linked(context, loop, loop_signature)(builder, [builder.call(threads, []), number, *addresses])
        return context.get_dummy_value()

    return types.none(types.intp, piece, arguments), generate


def _linked(context: Any, function: Any, signature: Any) -> Callable[..., Any]:
    found = context.get_function(function, signature)
    context.add_linking_libs(getattr(found, "libs", ()))
    return found
