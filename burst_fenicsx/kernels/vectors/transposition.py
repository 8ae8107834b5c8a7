"""Nodal vectors turned into rows over the lanes and back, `WIDTH` at a time; addresses of arrays, and prefetching.

dolfinx and output want fields vector by vector; the kernels compute on rows, one component of all lanes after the
other. Moved number by number that takes a fifth of a step. LLVM's generic instructions: any processor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

from burst_fenicsx.kernels.lanes import LANES

if TYPE_CHECKING:
    from collections.abc import Callable

WIDTH = 8
"""Vectors that are turned together."""

_DOUBLE, _INDEX = ir.DoubleType(), ir.IntType(32)
_PAIR, _ROW = ir.VectorType(_DOUBLE, 2), ir.VectorType(_DOUBLE, WIDTH)
_FIRSTS = [0, 8, 2, 10, 4, 12, 6, 14]  # of pairs 0, 2, 4, 6 and 1, 3, 5, 7, one after the other; `_SECONDS` likewise
_SECONDS = [number + 1 for number in _FIRSTS]


@intrinsic
def load_triples(
    typing_context: Any,  # noqa: ARG001
    values: Any,
    others: Any,
    finest: Any,
    level: Any,
    nodes: Any,
    first: Any,
    rows: Any,
    start: Any,
) -> tuple[Any, Callable[..., Any]]:
    """Copy vectors of `WIDTH` nodes to rows: component i of the k-th to `rows[start + i LANES + k]`.

    The nodes are `nodes.flat[first + k]` (int32), their vectors stand in `values` (nodes, 3), or in `others` where
    `finest` (nodes,) int8 is above the `level`.
    """
    _check(values, others, finest, nodes, rows)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        own, other, finest, numbers, rows = (_data(context, builder, signature, arguments, k) for k in (0, 1, 2, 4, 6))
        pairs, thirds = [], ir.Constant(_ROW, ir.Undefined)
        for k in range(WIDTH):
            node = _node(builder, numbers, arguments[5], k)
            coarse = builder.icmp_signed(
                ">", builder.sext(builder.load(builder.gep(finest, [node])), arguments[3].type), arguments[3]
            )
            vector = _vector(builder, builder.select(coarse, other, own), node)
            pairs.append(builder.load(builder.bitcast(vector, _PAIR.as_pointer()), align=8))
            third = builder.load(builder.gep(vector, [_INDEX(2)]))
            thirds = builder.insert_element(thirds, third, _INDEX(k))
        even, odd = _joined(builder, pairs[0::2]), _joined(builder, pairs[1::2])
        components = _shuffled(builder, even, odd, _FIRSTS), _shuffled(builder, even, odd, _SECONDS), thirds
        for i, component in enumerate(components):
            builder.store(component, _row(builder, rows, arguments[7], i), align=8)
        return context.get_dummy_value()

    return types.none(values, others, finest, level, nodes, first, rows, start), generate


@intrinsic
def add_triples(
    typing_context: Any,  # noqa: ARG001
    rows: Any,
    start: Any,
    nodes: Any,
    first: Any,
    values: Any,
) -> tuple[Any, Callable[..., Any]]:
    """Add rows to the vectors of `WIDTH` nodes, one after the other; arguments as of `load_triples`."""
    _check(rows, nodes, values)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        rows, numbers, values = (_data(context, builder, signature, arguments, k) for k in (0, 2, 4))
        x, y, z = (builder.load(_row(builder, rows, arguments[1], i), align=8) for i in range(3))
        even, odd = _shuffled(builder, x, y, _FIRSTS), _shuffled(builder, x, y, _SECONDS)
        for k in range(WIDTH):
            vector = _vector(builder, values, _node(builder, numbers, arguments[3], k))
            pair = _shuffled(builder, odd if k % 2 else even, odd, [k // 2 * 2, k // 2 * 2 + 1])
            where = builder.bitcast(vector, _PAIR.as_pointer())
            builder.store(builder.fadd(builder.load(where, align=8), pair), where, align=8)
            where = builder.gep(vector, [_INDEX(2)])
            third = builder.extract_element(z, _INDEX(k))
            builder.store(builder.fadd(builder.load(where), third), where)
        return context.get_dummy_value()

    return types.none(rows, start, nodes, first, values), generate


def _check(*arrays: Any) -> None:
    if any(array.layout != "C" for array in arrays):
        raise TypingError("vectors lie without gaps here")


def _data(context: Any, builder: Any, signature: Any, arguments: Any, number: int) -> Any:
    return context.make_array(signature.args[number])(context, builder, arguments[number]).data


def _node(builder: Any, numbers: Any, first: Any, k: int) -> Any:
    number = builder.load(builder.gep(numbers, [builder.add(first, ir.Constant(first.type, k))]))
    return builder.zext(number, ir.IntType(64))


def _vector(builder: Any, values: Any, node: Any) -> Any:
    return builder.gep(values, [builder.mul(node, ir.Constant(node.type, 3))])


def _row(builder: Any, rows: Any, start: Any, i: int) -> Any:
    place = builder.gep(rows, [builder.add(start, ir.Constant(start.type, i * LANES))])
    return builder.bitcast(place, _ROW.as_pointer())


def _joined(builder: Any, vectors: list[Any]) -> Any:
    """Vectors one behind the other."""
    while len(vectors) > 1:
        both = list(range(2 * vectors[0].type.count))
        vectors = [_shuffled(builder, a, b, both) for a, b in zip(vectors[0::2], vectors[1::2], strict=True)]
    return vectors[0]


def _shuffled(builder: Any, a: Any, b: Any, numbers: list[int]) -> Any:
    mask = ir.Constant(ir.VectorType(_INDEX, len(numbers)), [_INDEX(number) for number in numbers])
    return builder.shuffle_vector(a, b, mask)


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
