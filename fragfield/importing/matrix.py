"""Arena tables with zones in the rows and groups of mass in the columns."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from flight.files.text_tables import converted
from fragfield.errors import InputError
from fragfield.importing.cells import QUANTITIES, Interval, NotANumberError, is_unit, plain, read_head, unit_of
from fragfield.importing.sheet import Guess, QuestionError

if TYPE_CHECKING:
    from collections.abc import Mapping

    from numpy.typing import NDArray

    from fragfield.importing.layout import Layout
    from fragfield.importing.sheet import Row

    Array = NDArray[np.float64]


@dataclass
class Matrix:
    """Numbers by zone and group."""

    at: tuple[int, ...]
    """Columns of the groups."""
    numbers: Array
    """(rows, groups): of fragments; empty cells hold none."""
    groups: tuple[Array, Array, Array]
    """three arrays (groups,): lower and upper edge and mean mass (kg)."""
    guesses: list[Guess]
    """How it was read."""


def matrix_of(layout: Layout, units: Mapping[str, str]) -> Matrix | None:
    """Groups of mass in the names of two or more columns; None where there are none.

    A row whose first text means "mean mass" holds the mean masses of the groups, and is taken out of the layout. Raises
    InputError: a cell is not a number. `QuestionError` where the unit or the mean masses of the groups are not said.
    """
    groups: dict[int, Interval] = {}
    titles: set[str] = set()
    for at, title in enumerate(layout.names):
        found = _group(layout, title)
        if found is not None:
            groups[at] = found[0]
            titles.add(found[1])
    if len(groups) < 2:
        return None
    path, columns = layout.sheet.path, tuple(groups)
    stated = {one.unit for one in groups.values() if one.unit} | {one for one in titles if is_unit(one)}
    text = units.get("mass_group") or units.get("mass") or (next(iter(stated)) if len(stated) == 1 else "")
    if not text:
        choices = [f"mass={one}" for one in (sorted(stated) or QUANTITIES["mass"].likely)]
        raise QuestionError(f"{path}: the unit of the groups of mass {_shown(groups)} is not said", "unit", choices)
    factor = unit_of(text, QUANTITIES["mass"], f"{path}: groups of mass", "mass")
    if factor is None:
        raise InputError(f"{path}: groups of mass: found the unit {text!r}; allowed: one of mass, such as g, kg, grain")
    low = converted(np.array([one.low for one in groups.values()]), factor)
    high = converted(np.array([one.high for one in groups.values()]), factor)
    mean = _means(layout, columns, factor)
    if mean is None:
        raise InputError(
            f"{path}: the mean masses of the groups {_shown(groups)} are not said; put a row named 'mean mass' with "
            "them above the numbers, or give the table one row a zone and group, with its mean mass"
        )
    cells = np.array([[_number(layout, row, one) for one in columns] for row in layout.rows])
    words = f"{len(groups)} groups from {low[0] * 1e3:g} to {high[-1] * 1e3:g} g"
    guesses = [
        Guess("layout", "zones by groups of mass", f"the names of {len(groups)} columns are ranges of mass"),
        Guess("groups of mass", words, f"in {text}, {'as given' if text in units.values() else 'as the names say'}"),
    ]
    return Matrix(columns, cells, (low, high, mean), guesses)


def _shown(groups: Mapping[int, Interval]) -> str:
    first = ", ".join(f"{one.low:g} to {one.high:g}" for one in list(groups.values())[:3])
    return f"{first}{', ...' if len(groups) > 3 else ''}"


def _group(layout: Layout, title: str) -> tuple[Interval, str] | None:
    """Range of mass in a column's name, and a unit in what stands before it (a group of columns)."""
    words = title.split(" ")
    for start in range(len(words)):
        text = " ".join(words[start:])
        try:
            found = layout.numbers.interval(text)
        except NotANumberError:
            found = None
        if found is not None and (start == 0 or not layout.numbers.is_number(words[start - 1])):
            heads = read_head(" ".join(words[:start])) if start else []
            unit = next((one.unit for one in heads if one.unit), "")
            if heads and not any(plain(one.name).split() for one in heads):
                unit = ""
            return found, unit
    return None


def _means(layout: Layout, at: tuple[int, ...], factor: float) -> Array | None:
    """Mean masses of the groups from a row that is called so; it is taken out."""
    names = QUANTITIES["mean_mass"].names
    for row in layout.rows:
        texts = [head.name for cell in row.cells if isinstance(cell, str) for head in read_head(cell)]
        if not any(text in names for text in texts):
            continue
        layout.rows.remove(row)
        return converted(np.array([_number(layout, row, one) for one in at]), factor)
    return None


def _number(layout: Layout, row: Row, at: int) -> float:
    cell = row.cells[at]
    if cell in ("", "-", "–", "—"):
        return 0.0
    try:
        value = layout.numbers.value(cell)
    except NotANumberError as error:
        raise InputError(f"{layout.sheet.place(row.line, at)}: {error}") from None
    if not math.isfinite(value) or value < 0.0:
        raise InputError(f"{layout.sheet.place(row.line, at)}: found {value:g}; needed: 0 or more")
    return value
