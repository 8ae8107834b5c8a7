"""Rows of a table as text: every cell is appended to the row's bytes, column after column.

Decimal numbers have ten significant digits, to the last one those of C's "%.10g". The value times a power of ten is
computed in twice the precision (Dekker 1971, Numer. Math. 18, 224-242), where the tenth digit is certain except within
1e-12 of the middle between two of them. Those, and what is beyond the table of powers, are left to the caller.
"""

from __future__ import annotations

import math
from fractions import Fraction
from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.kernels.compiling import kernel

if TYPE_CHECKING:
    from numpy.typing import NDArray

__all__ = ["NUMBER_WIDTH", "append_numbers", "append_texts", "append_whole_numbers", "packed", "powers_of_ten"]

NUMBER_WIDTH = 24
"""Bytes that a number takes at most, with the mark behind it."""

DIGITS = 10
LARGEST = 60  # decimal exponent of the table
_SPLIT = 134217729.0  # 2^27 + 1
_UNSURE = 1e-12
_LOG_TWO = math.log10(2.0)
_ZERO, _POINT, _MINUS, _PLUS, _E = (np.uint8(ord(letter)) for letter in "0.-+e")
_TEN = np.uint64(10)


@cache
def powers_of_ten() -> NDArray[np.float64]:
    """Powers of ten from -`LARGEST` to `LARGEST`, each as the sum of two doubles, (2 `LARGEST` + 1, 2)."""
    table = np.zeros((2 * LARGEST + 1, 2))
    for row, power in enumerate(range(-LARGEST, LARGEST + 1)):
        exact = Fraction(10) ** power
        table[row, 0] = float(exact)
        table[row, 1] = float(exact - Fraction(float(exact)))
    return table


@kernel
def _scaled(value: float, high: float, low: float) -> tuple[float, float]:
    """Product of a double and the sum of two doubles, as the sum of two doubles."""
    product = value * high
    split = _SPLIT * value
    value_high = split - (split - value)
    value_low = value - value_high
    split = _SPLIT * high
    high_high = split - (split - high)
    high_low = high - high_high
    error = ((value_high * high_high - product) + value_high * high_low + value_low * high_high) + value_low * high_low
    error += value * low
    total = product + error
    return total, error - (total - product)


@kernel
def _put_whole(text: NDArray[Any], offset: int, value: int, number: int) -> int:
    """Put the last `number` digits of a whole number from zero; gives the offset behind."""
    rest = np.uint64(value)  # divided sooner than a number with a sign
    for back in range(number):
        tenth = rest // _TEN
        text[offset + number - 1 - back] = np.uint8(rest - tenth * _TEN) + _ZERO
        rest = tenth
    return offset + number


@kernel
def _put_digits(text: NDArray[Any], offset: int, digits: int, exponent: int) -> int:
    """Put a number of ten digits with its point behind the first one times 10^exponent, in the form of "%.10g"."""
    rest, held = np.uint64(digits), DIGITS
    tenth = rest // _TEN
    while held > 1 and rest == tenth * _TEN:
        rest, tenth, held = tenth, tenth // _TEN, held - 1
    kept = np.int64(rest)
    if exponent < -4 or exponent >= DIGITS:
        end = _put_whole(text, offset + 1, kept, held)
        text[offset] = text[offset + 1]
        text[offset + 1] = _POINT
        if held == 1:
            end = offset + 1
        text[end] = _E
        text[end + 1] = _MINUS if exponent < 0 else _PLUS
        return int(_put_whole(text, end + 2, abs(exponent), 2))  # below 100 within the table
    if exponent < 0:
        text[offset], text[offset + 1] = _ZERO, _POINT
        for zero in range(-exponent - 1):
            text[offset + 2 + zero] = _ZERO
        return int(_put_whole(text, offset + 1 - exponent, kept, held))
    if held <= exponent + 1:
        end = _put_whole(text, offset, kept, held)
        for zero in range(exponent + 1 - held):
            text[end + zero] = _ZERO
        return int(end + exponent + 1 - held)
    _put_whole(text, offset + 1, kept, held)
    for ahead in range(exponent + 1):
        text[offset + ahead] = text[offset + ahead + 1]
    text[offset + exponent + 1] = _POINT
    return int(offset + held + 1)


@kernel
def append_numbers(
    values: NDArray[Any], powers: NDArray[Any], mark: int, text: NDArray[Any], ends: NDArray[Any], left: NDArray[Any]
) -> int:
    """Append a decimal number and a mark to every row.

    Parameters
    ----------
    values : (n,) float64
    powers : as `powers_of_ten` makes them
    mark : byte behind every number
    text : (n, w) uint8, the rows
    ends : (n,) int64, how far each is filled
    left : (n,) int64, receives the rows that are left to the caller, unchanged

    Returns
    -------
    int
        The number of rows left.
    """
    unsure = 0
    for row in range(values.size):
        value, offset = abs(values[row]), ends[row]
        if math.copysign(1.0, values[row]) < 0.0:
            text[row, offset] = _MINUS
            offset += 1
        if value == 0.0:
            text[row, offset] = _ZERO
            text[row, offset + 1] = mark
            ends[row] = offset + 2
            continue
        if not 1e-45 < value < 1e45:
            left[unsure] = row
            unsure += 1
            continue
        exponent = math.floor((math.frexp(value)[1] - 1) * _LOG_TWO)  # or one more
        if value >= powers[LARGEST + exponent + 1, 0]:
            exponent += 1
        shift = LARGEST + DIGITS - 1 - exponent
        high, low = _scaled(value, powers[shift, 0], powers[shift, 1])
        whole = math.floor(high)
        rest = (high - whole) + low
        digits = int(whole)
        if abs(rest - 0.5) < _UNSURE:
            left[unsure] = row
            unsure += 1
            continue
        if rest > 0.5:
            digits += 1
        if digits < 1_000_000_000 or digits > 10_000_000_000:
            left[unsure] = row
            unsure += 1
            continue
        if digits == 10_000_000_000:
            digits, exponent = 1_000_000_000, exponent + 1
        offset = _put_digits(text[row], offset, digits, exponent)
        text[row, offset] = mark
        ends[row] = offset + 1
    return unsure


@kernel
def append_whole_numbers(values: NDArray[Any], mark: int, text: NDArray[Any], ends: NDArray[Any]) -> None:
    """Append a whole number (n,) int64 above -2^63 and a mark to every row; see `append_numbers`."""
    for row in range(values.size):
        value, offset = values[row], ends[row]
        if value < 0:
            text[row, offset] = _MINUS
            offset, value = offset + 1, -value
        number, rest = 1, value // 10
        while rest > 0:
            number, rest = number + 1, rest // 10
        offset = _put_whole(text[row], offset, value, number)
        text[row, offset] = mark
        ends[row] = offset + 1


@kernel
def append_texts(
    which: NDArray[Any], letters: NDArray[Any], starts: NDArray[Any], mark: int, text: NDArray[Any], ends: NDArray[Any]
) -> None:
    """Append one of some texts (`letters` end to end, from `starts` on) by its number, and a mark, to every row."""
    for row in range(which.size):
        offset = ends[row]
        for letter in range(starts[which[row]], starts[which[row] + 1]):
            text[row, offset] = letters[letter]
            offset += 1
        text[row, offset] = mark
        ends[row] = offset + 1


@kernel
def packed(text: NDArray[Any], ends: NDArray[Any], joined: NDArray[Any]) -> int:
    """Put the filled parts of all rows end to end; gives their length."""
    offset = 0
    for row in range(ends.size):
        for letter in range(ends[row]):
            joined[offset + letter] = text[row, letter]
        offset += ends[row]
    return offset
