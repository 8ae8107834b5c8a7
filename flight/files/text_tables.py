"""CSV tables with a line of column names: the one writer, and the one reader of arena, fragments, pit and drag tables.

Tables are written with commas and nothing above their column names, so that every program reads them. Those that are
read may have commas, semicolons or tabs between their cells, as the line of column names shows; lines
that start with # are comments. A quantity may be in any unit that its column's name ends with, as `mean_mass_g` in
place of `mean_mass_kg`. Any other form is for `fragfield import`, which the message names.
"""

from __future__ import annotations

import io
import shlex
from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from fragfield_base.reading import read_text
from fragfield_base.units import UnitError, read_measure
from fragfield_base.writing import csv_cell, replacing

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray


ROWS_AT_ONCE = 10_000  # so that the text of a million rows never stands in memory at once

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}
"""What may stand between the cells of a table that is read, and its name."""


@dataclass(frozen=True, eq=False)
class Labels:
    """A column of few texts that many rows share."""

    texts: Sequence[str]
    """Each once."""
    which: NDArray[Any]
    """(n,) int: number of every row's text."""

    def __len__(self) -> int:
        return len(self.which)

    @classmethod
    def of(cls, values: NDArray[Any]) -> Labels:
        """Labels of an array of texts."""
        texts, which = np.unique(values, return_inverse=True)
        return cls(texts.tolist(), which)


def write_columns(path: Path, columns: Mapping[str, NDArray[Any] | Labels]) -> Path:
    """Write equally long columns: whole numbers in full, others with ten significant digits, as "%.10g" does."""
    shown = [_column(column) for column in columns.values()]
    line = ",".join(_format(column) for column in shown) + "\n"
    with replacing(path, InputError) as file:
        file.write((",".join(map(csv_cell, columns)) + "\n").encode())
        for start in range(0, len(shown[0]), ROWS_AT_ONCE):
            rows = slice(start, start + ROWS_AT_ONCE)
            cells = zip(*(_cells(column, rows) for column in shown), strict=True)
            file.write("".join(map(line.__mod__, cells)).encode())
    return path


def _column(values: NDArray[Any] | Labels) -> NDArray[Any] | Labels:
    if isinstance(values, Labels):
        return values
    found = np.asarray(values)
    return Labels.of(found) if found.dtype.kind in "US" else found


def _format(column: NDArray[Any] | Labels) -> str:
    if isinstance(column, Labels):
        return "%s"
    return "%d" if column.dtype.kind in "iub" else "%.10g"


def _cells(column: NDArray[Any] | Labels, rows: slice) -> list[Any]:
    if not isinstance(column, Labels):
        return list(column[rows].tolist())
    texts = [csv_cell(text) for text in column.texts]
    return [texts[number] for number in column.which[rows].tolist()]


def read_columns(path: Path, kind: str = "") -> dict[str, NDArray[np.float64]]:
    """Read a table of numbers as one float64 array a column.

    Cells are separated by commas, semicolons or tabs, as in the line of column names; decimals have a point. `kind` is
    that of `fragfield import --kind`, for the message about a table of another form. Raises InputError: no such file,
    no table in it, several or no delimiters in the column names, or a cell that is not a number (the message names the
    line, and how a table of another form is converted).
    """
    try:
        return _read_columns(path)
    except InputError as error:
        raise InputError(f"{error}{import_hint(path, kind)}") from None


def import_hint(path: Path, kind: str = "") -> str:
    """End of a message about a table of another form: what converts it (`--kind`); empty where there is no file."""
    if not path.is_file():
        return ""
    words = f"{shlex.quote(str(path))}{f' --kind {kind}' if kind else ''}"
    return f"; another form is converted by: fragfield import {words} --out {shlex.quote(f'{path.stem}_converted.csv')}"


def _read_columns(path: Path) -> dict[str, NDArray[np.float64]]:
    text = read_text(path, InputError)
    lines = _table_lines(text)
    if not lines:
        raise InputError(f"{path}: no table in it; needed a line of column names and rows of numbers")
    names, delimiter = column_names(path, lines[0][1])
    if len(set(names)) != len(names):
        raise InputError(f"{path}: two columns of one name in {', '.join(names)}")
    body = lines[1:]
    if not body:
        raise InputError(f"{path}: no rows below the column names {', '.join(names)}")
    try:
        table = np.loadtxt(io.StringIO("\n".join(line for _, line in body)), delimiter=delimiter, ndmin=2)
        if table.shape[1] != len(names):
            raise ValueError
    except ValueError:
        raise InputError(f"{path}: {_first_bad_line(body, names, delimiter)}") from None
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def in_columns_of(
    path: Path, columns: Mapping[str, NDArray[np.float64]], known: Sequence[str]
) -> dict[str, NDArray[np.float64]]:
    """Columns under the `known` names, converted where a name ends with another unit of the same dimension.

    Raises InputError: one quantity stands in two columns; names that are not known stay as they are.
    """
    stems = {name.removesuffix(f"_{unit}"): (name, unit) for name in known if (unit := _unit_at_end(name))}
    found: dict[str, NDArray[np.float64]] = {}
    for column, values in columns.items():
        unit = _unit_at_end(column)
        name, wanted = stems.get(column.removesuffix(f"_{unit}"), (column, "")) if unit else (column, "")
        if wanted and unit != wanted:
            factor = _in_si(unit), _in_si(wanted)
            if factor[0][1] == factor[1][1]:
                values = converted(values, factor[0][0] / factor[1][0])
            else:
                name = column
        if name in found:
            raise InputError(f"{path}: {name} stands in two columns, in two units; allowed: one of them")
        found[name] = values
    return found


def converted(values: NDArray[np.float64], factor: float) -> NDArray[np.float64]:
    """Values in another unit, to 15 digits: 12.5 g is the very float of 0.0125 kg."""
    if factor == 1.0:
        return values
    return np.array([float(f"{value:.15g}") for value in (values * factor).tolist()], dtype=np.float64)


def _unit_at_end(column: str) -> str:
    """Unit that a column's name ends with, as `m_s` of `speed_m_s`; empty where there is none."""
    words = column.split("_")
    for count in (2, 1):
        unit = "_".join(words[-count:])
        if len(words) > count and _in_si(unit)[0]:
            return unit
    return ""


@lru_cache(maxsize=500)
def _in_si(unit: str) -> tuple[float, object]:
    """A unit as column names have it, in SI, with its dimension; (0, None) of what is no unit."""
    try:
        measure = read_measure(f"1 {unit.replace('_', '/')}")
    except UnitError:
        return 0.0, None
    return measure.value, measure.powers


def column_names(path: Path, head: str) -> tuple[list[str], str]:
    """Column names of a table, and the delimiter between its cells.

    `head` is its first line that is neither empty nor a comment. Raises InputError where it holds several of
    `DELIMITERS`, or none of them between words.
    """
    found = [mark for mark in DELIMITERS if mark in head]
    allowed = "comma, semicolon or tab"
    if len(found) > 1:
        words = " and ".join(DELIMITERS[mark] for mark in found)
        raise InputError(f"{path}: found {words} in the line of column names, {head.strip()!r}; allowed: one {allowed}")
    if not found and len(head.split()) > 1:
        raise InputError(
            f"{path}: no delimiter in the line of column names, {head.strip()!r}; allowed between cells: {allowed}"
        )
    delimiter = found[0] if found else ","
    return [name.strip() for name in head.split(delimiter)], delimiter


def line_of_row(path: Path, row: int) -> int:
    """Line of the file, counted from 1, that holds a row of its table, counted from 0."""
    return _table_lines(read_text(path, InputError))[1 + row][0]


def _table_lines(text: str) -> list[tuple[int, str]]:
    """Column names and rows with their line numbers."""
    return [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]


def _first_bad_line(body: list[tuple[int, str]], names: list[str], delimiter: str) -> str:
    for number, line in body:
        cells = line.split(delimiter)
        if len(cells) != len(names):
            other = [name for mark, name in DELIMITERS.items() if mark != delimiter and mark in line]
            hint = f"; it holds {' and '.join(other)}, the column names {DELIMITERS[delimiter]}" if other else ""
            return f"line {number} has {len(cells)} cells, the {len(names)} columns are {', '.join(names)}{hint}"
        for name, cell in zip(names, cells, strict=True):
            try:
                float(cell)
            except ValueError:
                point = "; decimals need a point" if delimiter != "," and "," in cell else ""
                return f"line {number}, column {name}: {cell.strip()!r} is not a number{point}"
    return "cannot be read as a table of numbers"
