"""Cells as numbers: decimal signs, marks between thousands, units behind numbers, ranges."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING, NamedTuple

from fragfield.errors import InputError
from fragfield.importing.dialect import Guess, decimal_marks
from fragfield.importing.names import is_unit
from fragfield.importing.sheet import QuestionError, Refused

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fragfield.importing.sheet import Cell, Row, Sheet

__all__ = ["Interval", "NotANumberError", "Numbers", "decimal_of"]

_SPACES = re.compile(r"(?<=\d)[ \xa0\u202f\u2009'’](?=\d{3}(?!\d))")
_PLAIN = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?")
_WITH_UNIT = re.compile(r"([-+−]?[\d.,'’ \xa0\u202f\u2009]*\d[.,]?(?:[eE][-+−]?\d+)?)\s*([^\d\s.,].*)")
_TO = r"(?:\s*(?:\.\.+|…|–|—|-|:|;)\s*|\s+(?:to|bis|a|à|und|and)\s+|\s*<\s*)"
_SIDE = r"[\[(]?\s*(?P<{0}>[\d.,'’\xa0\u202f]*\d[.,]?)\s*(?P<{0}unit>[^\W\d_]+|°|µ\w+)?\s*[\])]?"
_RANGE = re.compile(_SIDE.format("low") + _TO + _SIDE.format("high"), re.IGNORECASE)
_BELOW = re.compile(
    r"(?:<=?|≤|up to|bis|unter|below|less than|under|jusqu.?[aà]|moins de)\s*" + _SIDE.format("high"), re.IGNORECASE
)
_ABOVE = re.compile(
    r"(?:>=?|≥|over|above|more than|ueber|über|ab|mehr als|plus de|au.?dessus de)\s*" + _SIDE.format("low")
    + "|" + _SIDE.format("more") + r"\s*(?:\+|and over|und mehr|et plus)", re.IGNORECASE,
)  # fmt: skip


class NotANumberError(ValueError):
    """A cell is not a number; the message follows the cell's place."""


class Interval(NamedTuple):
    """A range of a quantity, and the unit that stands in it."""

    low: float
    high: float
    unit: str


class Numbers:
    """Reads cells with one decimal sign.

    Parameters
    ----------
    decimal : str
        "point" or "comma".
    """

    def __init__(self, decimal: str) -> None:
        self.decimal = decimal

    def value(self, cell: Cell) -> float:
        """A cell as a number; raises NotANumberError."""
        if isinstance(cell, Refused):
            raise NotANumberError(f"{cell.text!r} is {cell.reason}")
        if isinstance(cell, float):
            if not math.isfinite(cell):
                raise NotANumberError(f"{cell} is not finite")
            return cell
        text = _SPACES.sub("", cell.strip()).replace("−", "-")
        mark, other = (",", ".") if self.decimal == "comma" else (".", ",")
        if other in text:
            groups = text.lstrip("+-").split(mark)[0].split(other)
            if (
                not (1 <= len(groups[0]) <= 3 and all(len(one) == 3 for one in groups[1:]))
                or other in text.partition(mark)[2]
            ):
                raise NotANumberError(f"{cell!r} is not a number with a decimal {self.decimal}")
            text = text.replace(other, "")
        text = text.replace(mark, ".")
        if not _PLAIN.fullmatch(text):
            raise NotANumberError(f"{cell!r} is not a number")
        return float(text)

    def is_number(self, cell: Cell) -> bool:
        """Whether a cell is a number, or one with a unit behind it."""
        try:
            self.with_unit(cell)
        except NotANumberError:
            return False
        return True

    def has_unit(self, cell: Cell) -> bool:
        """Whether a cell is a number with something behind it."""
        return self.is_number(cell) and bool(self.with_unit(cell)[1])

    def or_zero(self, cell: Cell) -> float:
        """A cell as a number, zero of what is none."""
        return self.with_unit(cell)[0] if self.is_number(cell) else 0.0

    def with_unit(self, cell: Cell) -> tuple[float, str]:
        """A number and the unit behind it, as in "12,5 g"; raises NotANumberError."""
        if isinstance(cell, str) and (match := _WITH_UNIT.fullmatch(cell.strip())) and is_unit(match[2].strip()):
            return self.value(match[1]), match[2].strip()
        return self.value(cell), ""

    def interval(self, cell: Cell, *, bare: str = "") -> Interval | None:
        """A range such as "0-5", "0,1 bis 0,5 g", "< 1" or "> 50 g"; None of anything else."""
        if not isinstance(cell, str):
            return None
        text = cell.strip()
        if match := _RANGE.fullmatch(text):
            low, high = self.value(match["low"]), self.value(match["high"])
            return Interval(low, high, match["highunit"] or match["lowunit"] or bare)
        if match := _BELOW.fullmatch(text):
            return Interval(0.0, self.value(match["high"]), match["highunit"] or bare)
        if match := _ABOVE.fullmatch(text):
            name = "low" if match["low"] else "more"
            return Interval(self.value(match[name]), math.inf, match[f"{name}unit"] or bare)
        return None


def decimal_of(sheet: Sheet, rows: Sequence[Row], decimal: str | None) -> tuple[str, Guess | None]:
    """Decimal sign of the rows of a table, and why.

    Raises
    ------
    InputError
        Cells contradict each other; `QuestionError` where none shows whether a mark stands before decimals or between
        thousands, as in 1.234.
    """
    if decimal is not None:
        if decimal not in ("point", "comma"):
            raise InputError(f"{sheet.path}: decimal {decimal!r}; allowed: point or comma")
        return decimal, Guess("decimal sign", decimal, "as given")
    cells = [(row.line, part) for row in rows for cell in row.cells if isinstance(cell, str) for part in _parts(cell)]
    found, shown = decimal_marks(part for _, part in cells)
    if found == "both":
        lines = {name: next(line for line, part in cells if part == cell) for name, cell in shown.items()}
        words = " and ".join(f"{shown[name]!r} in line {lines[name]} (decimal {name})" for name in sorted(shown))
        raise InputError(f"{sheet.path}: decimal signs contradict each other: {words}; write all numbers alike")
    if found == "either":
        line, cell = next((line, part) for line, part in cells if "." in part or "," in part)
        mark = "." if "." in cell else ","
        raise QuestionError(
            f"{sheet.place(line)}: {cell!r} is {cell.replace(mark, '.')} or {cell.replace(mark, '')}, and no cell of "
            "the table shows which",
            "decimal", ("point", "comma"),
        )  # fmt: skip
    if not found:
        return "point", None
    return found, Guess("decimal sign", found, f"{shown[found]!r} shows it")


def _parts(cell: str) -> list[str]:
    """The numbers of a cell: of a range both, of a number with a unit the number."""
    return re.findall(r"\d[\d.,'’ \xa0\u202f\u2009]*\d(?:[eE][-+]?\d+)?|\d", cell)
