"""CSV tables with a line of column names; lines that start with # carry provenance or a source.

Tables are written with commas. Those that are read may have commas, semicolons or tabs between their cells: the line of
column names shows which.
"""

from __future__ import annotations

import hashlib
import io
import json
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from fragfield_base.reading import read_text
from fragfield_base.writing import csv_cell, replacing

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["DELIMITERS", "Labels", "column_names", "line_of_row", "read_columns", "write_columns"]

ROWS_AT_ONCE = 10_000  # so that the text of a million rows never stands in memory at once

DELIMITERS = {",": "comma", ";": "semicolon", "\t": "tab"}
"""What may stand between the cells of a table that is read, and its name."""


@dataclass(frozen=True, eq=False)
class Labels:
    """A column of few texts that many rows share.

    Attributes
    ----------
    texts : sequence of str
        Each once.
    which : (n,) int
        Number of every row's text.
    """

    texts: Sequence[str]
    which: NDArray[Any]

    def __len__(self) -> int:
        """Number of rows."""
        return len(self.which)

    @classmethod
    def of(cls, values: NDArray[Any]) -> Labels:
        """Labels of an array of texts."""
        texts, which = np.unique(values, return_inverse=True)
        return cls(texts.tolist(), which)


def write_columns(path: Path, columns: Mapping[str, NDArray[Any] | Labels], provenance: Mapping[str, str]) -> Path:
    """Write equally long columns; every provenance entry becomes one line `# key = "JSON string"` at the head.

    A text of several lines (a case file) is not repeated there: its line has its number of lines and its SHA-256, which
    those of the HDF5 file of the same table can be compared with.

    Whole numbers are written in full, others with ten significant digits, as "%.10g" does.
    """
    shown = [_column(column) for column in columns.values()]
    line = ",".join(_format(column) for column in shown) + "\n"
    with replacing(path, InputError) as file:
        head = [f"# {key} = {json.dumps(_in_a_line(str(value)))}\n" for key, value in provenance.items()]
        file.write("".join([*head, ",".join(map(csv_cell, columns)), "\n"]).encode())
        for start in range(0, len(shown[0]), ROWS_AT_ONCE):
            rows = slice(start, start + ROWS_AT_ONCE)
            cells = zip(*(_cells(column, rows) for column in shown), strict=True)
            file.write("".join(map(line.__mod__, cells)).encode())
    return path


def _in_a_line(text: str) -> str:
    """A text of one line as it is; of a longer one its first characters are of no use: its size and its checksum."""
    lines = text.splitlines()
    if len(lines) < 2:
        return text
    return f"{len(lines)} lines, SHA-256 {hashlib.sha256(text.encode()).hexdigest()}"


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
    """Some rows of a column, as its format takes them."""
    if not isinstance(column, Labels):
        return list(column[rows].tolist())
    texts = [csv_cell(text) for text in column.texts]
    return [texts[number] for number in column.which[rows].tolist()]


def read_columns(path: Path) -> dict[str, NDArray[np.float64]]:
    """Read a table of numbers as one float64 array a column.

    Cells are separated by commas, semicolons or tabs, as in the line of column names; decimals have a point.

    Raises
    ------
    InputError
        No such file, no table in it, several or no delimiters in the column names, or a cell that is not a number (the
        message names the line).
    """
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


def column_names(path: Path, head: str) -> tuple[list[str], str]:
    """Column names of a table, and the delimiter between its cells.

    Parameters
    ----------
    path : Path
        The file, for messages.
    head : str
        Its first line that is neither empty nor a comment.

    Raises
    ------
    InputError
        The line holds several of `DELIMITERS`, or none of them between words.
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
