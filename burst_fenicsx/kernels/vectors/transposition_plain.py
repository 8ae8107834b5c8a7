"""What `transposition_vectors` does, number by number in plain loops: for compilers that refuse its instructions.

Slower, and to the same bits: numbers are only moved, and sums are taken in the same order.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from burst_fenicsx.kernels.lanes import LANES, kernel, lane_function
from burst_fenicsx.kernels.vectors.transposition_vectors import WIDTH, address, places

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["add_triples", "load_triples", "prefetch", "store_triples", "trial"]

_BYTES = 8
_DOUBLE = ir.DoubleType()


@intrinsic
def _read(typing_context: Any, place: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """The number at an address; numba has no word for that."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        return builder.load(builder.inttoptr(arguments[0], _DOUBLE.as_pointer()), align=_BYTES, typ=_DOUBLE)

    return types.float64(types.uint64), generate


@intrinsic
def _write(typing_context: Any, place: Any, value: Any) -> tuple[Any, Callable[..., Any]]:  # noqa: ARG001
    """Write a number to an address."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:  # noqa: ARG001
        builder.store(arguments[1], builder.inttoptr(arguments[0], _DOUBLE.as_pointer()), align=_BYTES)
        return context.get_dummy_value()

    return types.none(types.uint64, types.float64), generate


@lane_function
def prefetch(place: np.uint64) -> None:
    """Nothing: what is not brought near comes when it is read."""


@lane_function
def load_triples(places: tuple[np.uint64, ...], rows: np.ndarray, start: int) -> None:
    """Load three numbers each from eight addresses to rows: component i of vector k to `rows[start + i LANES + k]`."""
    for k in range(WIDTH):
        for i in range(3):
            rows[start + i * LANES + k] = _read(places[k] + np.uint64(_BYTES * i))


@lane_function
def store_triples(rows: np.ndarray, start: int, places: tuple[np.uint64, ...]) -> None:
    """Store rows to eight addresses, three numbers each: the reverse of `load_triples`."""
    for k in range(WIDTH):
        for i in range(3):
            _write(places[k] + np.uint64(_BYTES * i), rows[start + i * LANES + k])


@lane_function
def add_triples(rows: np.ndarray, start: int, places: tuple[np.uint64, ...]) -> None:
    """Add rows to what stands at eight addresses, three numbers each, one after the other: they may be the same."""
    for k in range(WIDTH):
        for i in range(3):
            at = places[k] + np.uint64(_BYTES * i)
            _write(at, _read(at) + rows[start + i * LANES + k])


@kernel
def trial(field: np.ndarray, rows: np.ndarray, other: np.ndarray) -> None:
    """Load eight vectors of `field` (9, 3), all but one, store them to `other` and add them there."""
    index = (
        np.uint64(8),
        np.uint64(1),
        np.uint64(2),
        np.uint64(3),
        np.uint64(4),
        np.uint64(5),
        np.uint64(6),
        np.uint64(0),
    )
    prefetch(address(field))
    load_triples(places(address(field), np.uint64(24), index), rows, 0)
    store_triples(rows, 0, places(address(other), np.uint64(24), index))
    add_triples(rows, 0, places(address(other), np.uint64(24), index))
