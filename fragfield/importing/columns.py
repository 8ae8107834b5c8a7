"""Columns of a layout as quantities in our units: by their names, or as the caller says."""

from __future__ import annotations

import math
import re
from typing import TYPE_CHECKING

import numpy as np

from flight.files.text_tables import converted
from fragfield.errors import InputError
from fragfield.importing.cells import GROUPS, QUANTITIES, Interval, NotANumberError, is_unit, read_head, unit_of
from fragfield.importing.sheet import Guess, QuestionError, Refused, letter
from fragfield_base.errors import names_allowed

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from numpy.typing import NDArray

    from fragfield.importing.layout import Layout
    from fragfield.importing.sheet import Cell, Row

    Array = NDArray[np.float64]


_DEGREE = math.pi / 180.0


class Columns:
    """Quantities of a table: numbers of their columns (`index`), and what the caller said.

    `units` are by quantity or by group (`GROUPS`), `chosen` columns by quantity.
    """

    def __init__(
        self, layout: Layout, index: Mapping[str, int], units: Mapping[str, str], chosen: Mapping[str, str]
    ) -> None:
        self.layout, self.index, self.units = layout, dict(index), dict(units)
        self.like: dict[str, tuple[str, str]] = {}
        self.guesses: list[Guess] = [
            Guess(f"column {name}", repr(self._title(at)), "as given" if name in chosen else "by its name")
            for name, at in index.items()
        ]

    def __contains__(self, name: str) -> bool:
        return name in self.index

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.layout.rows)

    def _title(self, at: int) -> str:
        return self.layout.names[at] or f"column {letter(at) if self.layout.sheet.name else at + 1}"

    def unused(self) -> list[str]:
        """Names of the columns that mean nothing here."""
        used = set(self.index.values())
        return [name for at, name in enumerate(self.layout.names) if name and at not in used]

    def place(self, row: Row, name: str) -> str:
        """Where a cell stands."""
        at = self.index[name]
        return f"{self.layout.sheet.place(row.line, at)} ({self._title(at)})"

    def cells(self, name: str) -> list[Cell]:
        """Cells of a quantity as they are."""
        return [row.cells[self.index[name]] for row in self.layout.rows]

    def intervals(self, name: str, unit: str) -> list[Interval | None]:
        """Ranges of a quantity in a unit (`deg` or SI); None where a cell is none."""
        read = self.layout.numbers.interval
        found = []
        for row, cell in zip(self.layout.rows, self.cells(name), strict=True):
            if isinstance(cell, Refused):
                raise InputError(f"{self.place(row, name)}: {cell.text!r} is {cell.reason}")
            try:
                found.append(read(cell))
            except NotANumberError as error:
                raise InputError(f"{self.place(row, name)}: {error}") from None
        units = {one.unit for one in found if one is not None and one.unit}
        if len(units) > 1:
            raise InputError(f"{self.layout.sheet.path}: {name} in {' and '.join(sorted(units))}; allowed: one unit")
        largest = max((one.high if math.isfinite(one.high) else one.low for one in found if one), default=0.0)
        if not any(found):
            return found
        factor = self.factor(name, unit, next(iter(units), ""), largest)
        both = [converted(np.array([one.low, one.high]), factor).tolist() if one else None for one in found]
        return [None if one is None else Interval(one[0], one[1], unit) for one in both]

    def values(self, name: str, unit: str = "") -> Array:
        """A quantity in its SI unit, or angles in degrees where `unit` is "deg"; NaN in empty cells.

        Raises InputError: a cell is not a number; `QuestionError` where its unit is not known.
        """
        numbers, units = [], set()
        for row, cell in zip(self.layout.rows, self.cells(name), strict=True):
            if cell == "":
                numbers.append(math.nan)
                continue
            try:
                value, behind = self.layout.numbers.with_unit(cell)
            except NotANumberError as error:
                raise InputError(f"{self.place(row, name)}: {error}; give the lines without it: --rows") from None
            if behind and not (QUANTITIES[name].unit and is_unit(behind)):
                raise InputError(
                    f"{self.place(row, name)}: {cell!r} is not a number; give the lines without it: --rows"
                )
            numbers.append(value)
            units.add(behind)
        array = np.array(numbers, dtype=np.float64)
        if not QUANTITIES[name].unit:
            return array
        if len(units) > 1:
            raise InputError(
                f"{self.layout.sheet.path}: {name}: cells with the units {sorted(units)}; allowed: one unit for all"
            )
        largest = float(np.nanmax(np.abs(array), initial=0.0)) if not np.isnan(array).all() else 0.0
        return converted(array, self.factor(name, unit or QUANTITIES[name].unit, next(iter(units), ""), largest))

    def whole(self, name: str, unit: str = "") -> Array:
        """As `values`; raises InputError where a cell is empty."""
        values = self.values(name, unit)
        self.refuse_empty(name, values, np.ones(len(values), dtype=bool))
        return values

    def refuse_empty(self, name: str, values: Array, held: NDArray[np.bool_]) -> None:
        """Refuse empty cells in the rows that hold something."""
        bad = np.isnan(values) & held
        if bad.any():
            row = self.layout.rows[int(np.argmax(bad))]
            more = f", and {int(bad.sum()) - 1} more" if bad.sum() > 1 else ""
            which = "every row" if held.all() else "every row with fragments"
            raise InputError(f"{self.place(row, name)}: empty{more}; needed: {name} in {which}")

    def require(self, *names: str) -> None:
        """Refuse a table that lacks quantities; the message has all its columns and how to name one."""
        missing = [name for name in names if name not in self]
        if missing:
            titles = [repr(one) for one in self.layout.names if one]
            have = f"found the columns {', '.join(titles)}" if titles else "found no names of columns"
            options = " ".join(f'--column {name}="{"NAME" if titles else 1}"' for name in missing)
            raise InputError(f"{self.layout.sheet.path}: {', '.join(missing)} missing; {have}; say which: {options}")

    def refuse_sum(self, number: Array) -> None:
        """Refuse a last row that counts as many as all others together: it adds them up, without a name that says so.

        Raises QuestionError with the lines that count.
        """
        if self.layout.are_given or len(number) < 3 or not number[-1] > 0.0:
            return
        if abs(number[:-1].sum() - number[-1]) < 1e-9 * number[-1]:
            rows = self.layout.rows
            raise QuestionError(
                f"{self.place(rows[-1], 'number')}: {number[-1]:g} is the sum of all rows above it, as in a row of "
                "sums; give the lines that count", "rows", [f"{max(rows[0].line - 1, 1)}:{rows[-2].line}"],
            )  # fmt: skip

    def same_unit(self, name: str, other: str) -> None:
        """Take the unit of another column, or what its values show of it, for one whose unit is not said."""
        mine = self._unit_text(name, "")[0].casefold()
        if not mine and not any(self.layout.numbers.has_unit(cell) for cell in self.cells(name)):
            largest = [abs(value) for cell in self.cells(other) if (value := self.layout.numbers.or_zero(cell))]
            text, _ = _angle(*self._unit_text(other, ""), max(largest, default=0.0))
            if text:
                self.like[name] = text, f"as {other}"

    def factor(self, name: str, wanted: str, in_cells: str, largest: float) -> float:
        """Factor of a column's unit to the wanted one; raises QuestionError where its unit is not known."""
        quantity = QUANTITIES[name]
        place = f"{self.layout.sheet.path}: {name} ({self._title(self.index[name])})"
        text, reason = self._unit_text(name, in_cells)
        if quantity.unit == "rad":
            text, reason = _angle(text, reason, largest)
        if not text:
            raise QuestionError(
                f"{place}: its unit is not said", "unit", [f"{GROUPS[quantity.unit]}={one}" for one in quantity.likely]
            )
        factor = unit_of(text, quantity, place, GROUPS[quantity.unit])
        if factor is None:
            raise InputError(
                f"{place}: found the unit {text!r}; allowed: one of {GROUPS[quantity.unit]}, "
                f"such as {', '.join(quantity.likely)}"
            )
        guess = Guess(f"unit of {name}", text, reason)
        if guess not in self.guesses:
            self.guesses.append(guess)
        if wanted == "deg":
            return 1.0 if abs(factor - _DEGREE) < 1e-15 else factor / _DEGREE
        return factor

    def _unit_text(self, name: str, in_cells: str) -> tuple[str, str]:
        at, quantity = self.index[name], QUANTITIES[name]
        for key in (name, GROUPS[quantity.unit]):
            if key in self.units:
                return self.units[key], "as given"
        if name in self.like:
            return self.like[name]
        if in_cells:
            return in_cells, "behind the numbers"
        if self.layout.units[at]:
            return self.layout.units[at], "row of units"
        heads = read_head(self.layout.names[at])
        place = f"{self.layout.sheet.path}: {name} ({self._title(at)})"
        known = [one for one in heads if one.unit]
        for head in sorted(known, key=lambda one: one.name not in quantity.names):
            if unit_of(head.unit, quantity, place, GROUPS[quantity.unit]) is not None:
                return head.unit, "in the column's name"
        return "", ""


def _angle(text: str, reason: str, largest: float) -> tuple[str, str]:
    """Unit of angles that go round to the tail: where it is not said, what their largest value shows."""
    if not text and abs(largest - 180.0) < 1e-6:
        return "deg", "they reach 180"
    if not text and abs(largest - math.pi) < 5e-3:
        return "rad", "they reach pi"
    if not text and 6.3 < largest < 180.0:
        return "deg", f"they reach {largest:g}, which no angle in radians does"
    return text, reason


def columns_by_name(layout: Layout, wanted: Sequence[str], chosen: Mapping[str, str]) -> dict[str, int]:
    """Number of the column of each wanted quantity that the table has.

    `chosen` holds names, numbers from 1 or letters of columns, by quantity. Raises InputError for a chosen column that
    is not there, `QuestionError` where two columns may be meant.
    """
    path = layout.sheet.path
    index = {name: _column(layout, name, text) for name, text in chosen.items() if name in wanted}
    taken = set(index.values())
    for at, title in enumerate(layout.names):
        if at in taken or not title:
            continue
        name = _meaning(title, layout.units[at], [one for one in wanted if one not in chosen])
        if name is None:
            continue
        if name in index:
            other = index[name]
            raise QuestionError(
                f"{path}: {name} may be {title!r} or {layout.names[other]!r} (columns {at + 1} and {other + 1})",
                "column", [f"{name}={other + 1}", f"{name}={at + 1}"],
            )  # fmt: skip
        index[name] = at
    return {name: index[name] for name in wanted if name in index}


_PART = re.compile(r"%|‰|percent|fraction", re.IGNORECASE)
"""What a column is called that holds parts of a whole; numbers "per degree" have a stroke in their name."""


def _meaning(title: str, unit: str, wanted: Sequence[str]) -> str | None:
    """The quantity that a column's name means; its unit, if any, must fit."""
    if _PART.search(f"{title} {unit}"):
        return None
    for head in read_head(title):
        for name in wanted:
            quantity = QUANTITIES[name]
            if head.name not in quantity.names or (not quantity.unit and "/" in title):
                continue
            text = head.unit or unit
            try:
                fits = not text or not is_unit(text) or unit_of(text, quantity, "", "") is not None
            except QuestionError:
                fits = True
            if fits:
                return name
    return None


def _column(layout: Layout, name: str, text: str) -> int:
    path, titles = layout.sheet.path, layout.names
    same = [at for at, title in enumerate(titles) if title and title.casefold() == text.strip().casefold()]
    if len(same) > 1:
        raise QuestionError(
            f"{path}: {len(same)} columns are called {text!r}", "column", [f"{name}={at + 1}" for at in same]
        )
    if same:
        return same[0]
    if text.isdigit() and 1 <= int(text) <= len(titles):
        return int(text) - 1
    if layout.sheet.name and text.isalpha() and text.isupper():
        at = next((at for at in range(len(titles)) if letter(at) == text), None)
        if at is not None:
            return at
    known = [title for title in titles if title]
    if not known:
        raise InputError(
            f"{path}: column {name}={text}: found no names, but {len(titles)} columns; allowed: 1 to {len(titles)}"
        )
    raise InputError(f"{path}: column {name}={text}{names_allowed(text, known)}")
