"""Short vectors of many cells or nodes turned into rows over the lanes, and back, by instructions of its own.

Fields of nodes and cells lie vector by vector, as dolfinx and output want them; the kernels compute on rows, one
component of all lanes after the other. Moved number by number that costs as much as the mechanics. Here eight vectors
are loaded whole and transposed by shuffles, which the compiler makes by itself only where addresses follow each other.
LLVM's generic instructions: any processor.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.errors import TypingError
from numba.extending import intrinsic

from burst_fenicsx.kernels.lanes import LANES, lane_function

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = [
    "WIDTH",
    "add_run",
    "add_triples",
    "address",
    "addresses",
    "later",
    "load_modes",
    "load_modes_of_runs",
    "load_run",
    "load_singles",
    "load_triples",
    "prefetch",
    "store_run",
    "store_singles",
    "store_triples",
]

WIDTH = 8
"""Vectors that are transposed together."""

_DOUBLE, _INDEX = ir.DoubleType(), ir.IntType(32)
_PLACES = types.UniTuple(types.uint64, WIDTH)
_BYTES = 8


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
        pointer = _pointer(builder, arguments[0], ir.IntType(8))
        kind = ir.FunctionType(ir.VoidType(), [pointer.type, _INDEX, _INDEX, _INDEX])
        function = cgutils.get_or_insert_function(builder.module, kind, "llvm.prefetch.p0")
        builder.call(function, [pointer, _INDEX(0), _INDEX(3), _INDEX(1)])
        return context.get_dummy_value()

    return types.none(types.uint64), generate


@lane_function
def addresses(start: np.uint64, size: np.uint64, index: tuple[np.uint64, ...]) -> tuple[np.uint64, ...]:
    """Addresses of eight vectors of a field that begins at `start` and has `size` bytes for each."""
    return (
        start + size * index[0],
        start + size * index[1],
        start + size * index[2],
        start + size * index[3],
        start + size * index[4],
        start + size * index[5],
        start + size * index[6],
        start + size * index[7],
    )


@lane_function
def later(start: tuple[np.uint64, ...], by: np.uint64) -> tuple[np.uint64, ...]:
    """Eight addresses, each some bytes farther on."""
    return (
        start[0] + by,
        start[1] + by,
        start[2] + by,
        start[3] + by,
        start[4] + by,
        start[5] + by,
        start[6] + by,
        start[7] + by,
    )


@intrinsic
def load_triples(typing_context: Any, places: Any, rows: Any, start: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Load three numbers each from eight addresses to rows: component i of vector k to `rows[start + i LANES + k]`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        found = _turned(builder, cgutils.unpack_tuple(builder, arguments[0], WIDTH))
        for i, row in enumerate(found):
            _store(builder, row, _row(context, builder, signature.args[1], arguments[1:], i, row.type))
        return context.get_dummy_value()

    return types.none(_PLACES, rows, types.intp), generate


@intrinsic
def store_triples(typing_context: Any, rows: Any, start: Any, places: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Store rows to eight addresses, three numbers each: the reverse of `load_triples`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        for place, pair, single in _triples(context, builder, signature.args[0], arguments):
            _store(builder, pair, _pointer(builder, place, pair.type))
            _store(builder, single, _pointer(builder, place, _DOUBLE, 2))
        return context.get_dummy_value()

    return types.none(rows, types.intp, _PLACES), generate


@intrinsic
def add_triples(typing_context: Any, rows: Any, start: Any, places: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Add rows to what stands at eight addresses, three numbers each, one after the other: they may be the same."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        for place, pair, single in _triples(context, builder, signature.args[0], arguments):
            for value, at in (pair, 0), (single, 2):
                pointer = _pointer(builder, place, value.type, at)
                _store(builder, builder.fadd(_load(builder, pointer, value.type), value), pointer)
        return context.get_dummy_value()

    return types.none(rows, types.intp, _PLACES), generate


@intrinsic
def load_singles(typing_context: Any, places: Any, rows: Any, start: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Load a number each from eight addresses, that of address k to `rows[start + k]`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        row = ir.VectorType(_DOUBLE, WIDTH)(ir.Undefined)
        for k, place in enumerate(cgutils.unpack_tuple(builder, arguments[0], WIDTH)):
            row = builder.insert_element(row, _load(builder, _pointer(builder, place, _DOUBLE), _DOUBLE), _INDEX(k))
        _store(builder, row, _row(context, builder, signature.args[1], arguments[1:], 0, row.type))
        return context.get_dummy_value()

    return types.none(_PLACES, rows, types.intp), generate


@intrinsic
def store_singles(typing_context: Any, rows: Any, start: Any, places: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Store `rows[start + k]` to the address k of eight: the reverse of `load_singles`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        eight = ir.VectorType(_DOUBLE, WIDTH)
        row = _load(builder, _row(context, builder, signature.args[0], arguments, 0, eight), eight)
        for k, place in enumerate(cgutils.unpack_tuple(builder, arguments[2], WIDTH)):
            _store(builder, builder.extract_element(row, _INDEX(k)), _pointer(builder, place, _DOUBLE))
        return context.get_dummy_value()

    return types.none(rows, types.intp, _PLACES), generate


@intrinsic
def load_run(typing_context: Any, place: Any, rows: Any, start: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """As `load_singles`, of numbers that follow one another from one address on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        eight = ir.VectorType(_DOUBLE, WIDTH)
        row = _load(builder, _pointer(builder, arguments[0], eight), eight)
        _store(builder, row, _row(context, builder, signature.args[1], arguments[1:], 0, eight))
        return context.get_dummy_value()

    return types.none(types.uint64, rows, types.intp), generate


@intrinsic
def store_run(typing_context: Any, rows: Any, start: Any, place: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """The reverse of `load_run`."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        eight = ir.VectorType(_DOUBLE, WIDTH)
        row = _load(builder, _row(context, builder, signature.args[0], arguments, 0, eight), eight)
        _store(builder, row, _pointer(builder, arguments[2], eight))
        return context.get_dummy_value()

    return types.none(rows, types.intp, types.uint64), generate


@intrinsic
def load_modes(typing_context: Any, places: Any, rows: Any, start: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Load three numbers each from eight addresses for every corner of eight hexahedra; their modes to rows.

    The modes are those of `cells.hexahedron`, in the order 1, 2, 4, 3, 5, 6, 7: component i of mode m of cell k to
    `rows[start + (3 m + i) LANES + k]`. They are made in the registers.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        corners = [
            _turned(builder, cgutils.unpack_tuple(builder, corner, WIDTH))
            for corner in cgutils.unpack_tuple(builder, arguments[0], 8)
        ]
        _store_modes(context, builder, signature, arguments, corners)
        return context.get_dummy_value()

    return types.none(types.UniTuple(_PLACES, 8), rows, types.intp), generate


@intrinsic
def load_modes_of_runs(typing_context: Any, places: Any, rows: Any, start: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """As `load_modes`, where the vectors of each corner follow one another from one address on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        corners = [_turned_run(builder, place) for place in cgutils.unpack_tuple(builder, arguments[0], 8)]
        _store_modes(context, builder, signature, arguments, corners)
        return context.get_dummy_value()

    return types.none(_PLACES, rows, types.intp), generate


@intrinsic
def add_run(typing_context: Any, rows: Any, start: Any, place: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """As `add_triples` to vectors that follow one another from one address on."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        eight = ir.VectorType(_DOUBLE, WIDTH)
        x, y, z = (
            _load(builder, _row(context, builder, signature.args[0], arguments, i, eight), eight) for i in range(3)
        )
        pairs = _shuffled(builder, x, y, [k // 2 + WIDTH * (k % 2) for k in range(2 * WIDTH)])
        whole = _shuffled(builder, z, z, [k % WIDTH for k in range(2 * WIDTH)])
        order = [2 * (k // 3) + k % 3 if k % 3 < 2 else 2 * WIDTH + k // 3 for k in range(3 * WIDTH)]
        for part in range(3):
            value = _shuffled(builder, pairs, whole, order[WIDTH * part : WIDTH * (part + 1)])
            pointer = _pointer(builder, arguments[2], eight, WIDTH * part)
            _store(builder, builder.fadd(_load(builder, pointer, eight), value), pointer)
        return context.get_dummy_value()

    return types.none(rows, types.intp, types.uint64), generate


def _store_modes(context: Any, builder: Any, signature: Any, arguments: Any, corners: list[Any]) -> None:
    """Modes of the rows of eight corners to rows."""
    for i in range(3):
        values = [corner[i] for corner in corners]
        for bit in (1, 2, 4):
            for low in (k for k in range(8) if not k & bit):
                one, other = values[low], values[low | bit]
                values[low], values[low | bit] = builder.fadd(one, other), builder.fsub(other, one)
        for m, mode in enumerate((1, 2, 4, 3, 5, 6, 7)):
            place = _row(context, builder, signature.args[1], arguments[1:], 3 * m + i, values[mode].type)
            _store(builder, values[mode], place)


def _turned(builder: Any, places: Any) -> tuple[Any, Any, Any]:
    """Rows of the three numbers at each of eight addresses."""
    vectors = [_load_three(builder, place) for place in places]
    # Four registers of two vectors each, (0, 4), (1, 5), (2, 6), (3, 7).
    doubled = [_shuffled(builder, vectors[k], vectors[k + 4], range(8)) for k in range(4)]
    even, odd = (0, 8, 2, 10, 4, 12, 6, 14), (1, 9, 3, 11, 5, 13, 7, 15)
    xz_low, y_low = (_shuffled(builder, doubled[0], doubled[1], part) for part in (even, odd))
    xz_high, y_high = (_shuffled(builder, doubled[2], doubled[3], part) for part in (even, odd))
    first, second = (0, 1, 8, 9, 4, 5, 12, 13), (2, 3, 10, 11, 6, 7, 14, 15)
    return (
        _shuffled(builder, xz_low, xz_high, first),
        _shuffled(builder, y_low, y_high, first),
        _shuffled(builder, xz_low, xz_high, second),
    )


def _turned_run(builder: Any, place: Any) -> list[Any]:
    """Rows of the three numbers of eight vectors that follow one another."""
    eight = ir.VectorType(_DOUBLE, WIDTH)
    a, b, c = (_load(builder, _pointer(builder, place, eight, WIDTH * part), eight) for part in range(3))
    low = _shuffled(builder, a, b, range(2 * WIDTH))
    high = _shuffled(builder, c, c, [k % WIDTH for k in range(2 * WIDTH)])
    return [_shuffled(builder, low, high, [3 * k + i for k in range(WIDTH)]) for i in range(3)]


def _triples(context: Any, builder: Any, array: Any, arguments: Any) -> list[tuple[Any, Any, Any]]:
    """Of each vector: its address, its first two components and its third one, from three rows."""
    eight = ir.VectorType(_DOUBLE, WIDTH)
    x, y, z = (_load(builder, _row(context, builder, array, arguments, i, eight), eight) for i in range(3))
    found = []
    for k, place in enumerate(cgutils.unpack_tuple(builder, arguments[2], WIDTH)):
        pair = _shuffled(builder, x, y, (k, WIDTH + k))
        found.append((place, pair, builder.extract_element(z, _INDEX(k))))
    return found


def _row(context: Any, builder: Any, array: Any, arguments: Any, i: int, kind: Any) -> Any:
    """Pointer to eight lanes of row i of `rows`, `start` in the first two of the arguments."""
    data = context.make_array(array)(context, builder, arguments[0]).data
    at = builder.add(arguments[1], ir.IntType(64)(i * LANES))
    return builder.bitcast(builder.gep(data, [at]), kind.as_pointer())


def _pointer(builder: Any, place: Any, kind: Any, at: int = 0) -> Any:
    """Pointer to the number `at` after an address."""
    return builder.inttoptr(builder.add(place, ir.IntType(64)(at * _BYTES)), kind.as_pointer())


def _load_three(builder: Any, place: Any) -> Any:
    """Three numbers at an address as a register of four; the fourth is not touched, it may lie outside the array."""
    four, mask = ir.VectorType(_DOUBLE, 4), ir.VectorType(ir.IntType(1), 4)
    pointer = _pointer(builder, place, four)
    kind = ir.FunctionType(four, [pointer.type, _INDEX, mask, four])
    masked = cgutils.get_or_insert_function(builder.module, kind, "llvm.masked.load.v4f64.p0")
    return builder.call(masked, [pointer, _INDEX(_BYTES), mask([1, 1, 1, 0]), four(ir.Undefined)])


def _load(builder: Any, pointer: Any, kind: Any) -> Any:
    return builder.load(pointer, align=_BYTES, typ=kind)


def _store(builder: Any, value: Any, pointer: Any) -> Any:
    return builder.store(value, pointer, align=_BYTES)


def _shuffled(builder: Any, first: Any, second: Any, order: Any) -> Any:
    """The numbers of two registers, one after the other, in a new order."""
    chosen = ir.VectorType(_INDEX, len(order))([int(k) for k in order])
    return builder.shuffle_vector(first, second, chosen)
