"""CSV tables with a line of column names; lines that start with # carry provenance or a source."""

from __future__ import annotations

import io
import json
from typing import TYPE_CHECKING, Any

import numpy as np

from flight.errors import InputError
from fragfield_base.csv_text import csv_cell
from fragfield_base.reading import read_text
from fragfield_base.writing import replacing

if TYPE_CHECKING:
    from collections.abc import Mapping
    from pathlib import Path

    from numpy.typing import NDArray

__all__ = ["line_of_row", "read_columns", "write_columns"]

ROWS_AT_ONCE = 20_000  # keeps the text of one write below some MB


def write_columns(path: Path, columns: Mapping[str, NDArray[Any]], provenance: Mapping[str, str]) -> Path:
    """Write equally long columns; every provenance entry becomes one line `# key = "JSON string"` at the head."""
    names = list(columns)
    arrays = [np.asarray(columns[name]) for name in names]

    row_format = ",".join("%d" if a.dtype.kind in "iub" else "%s" if a.dtype.kind in "US" else "%.10g" for a in arrays)
    number = len(arrays[0])
    with replacing(path, InputError) as file:
        head = [f"# {key} = {json.dumps(str(text))}\n" for key, text in provenance.items()]
        file.write("".join([*head, ",".join(map(csv_cell, names)), "\n"]).encode())
        for start in range(0, number, ROWS_AT_ONCE):
            rows = zip(*(_cells(a[start : start + ROWS_AT_ONCE]) for a in arrays), strict=True)
            file.write("".join([row_format % row + "\n" for row in rows]).encode())
    return path


def read_columns(path: Path) -> dict[str, NDArray[np.float64]]:
    """Read a table of numbers as one float64 array a column.

    Raises
    ------
    InputError
        No such file, no table in it, or a cell that is not a number (the message names the line).
    """
    text = read_text(path, InputError)
    lines = _table_lines(text)
    if not lines:
        raise InputError(f"{path}: no table in it; needed a line of column names and rows of numbers")
    names = [name.strip() for name in lines[0][1].split(",")]
    if len(set(names)) != len(names):
        raise InputError(f"{path}: two columns of one name in {', '.join(names)}")
    body = lines[1:]
    if not body:
        raise InputError(f"{path}: no rows below the column names {', '.join(names)}")
    try:
        table = np.loadtxt(io.StringIO("\n".join(line for _, line in body)), delimiter=",", ndmin=2)
        if table.shape[1] != len(names):
            raise ValueError
    except ValueError:
        raise InputError(f"{path}: {_first_bad_line(body, names)}") from None
    return {name: np.ascontiguousarray(table[:, i]) for i, name in enumerate(names)}


def line_of_row(path: Path, row: int) -> int:
    """Line of the file, counted from 1, that holds a row of its table, counted from 0."""
    return _table_lines(read_text(path, InputError))[1 + row][0]


def _cells(values: NDArray[Any]) -> list[Any]:
    return [csv_cell(text) for text in values.tolist()] if values.dtype.kind == "U" else values.tolist()


def _table_lines(text: str) -> list[tuple[int, str]]:
    """Column names and rows with their line numbers."""
    return [(i, line) for i, line in enumerate(text.splitlines(), 1) if line.strip() and not line.startswith("#")]


def _first_bad_line(body: list[tuple[int, str]], names: list[str]) -> str:
    for number, line in body:
        cells = line.split(",")
        if len(cells) != len(names):
            return f"line {number} has {len(cells)} cells, the {len(names)} columns are {', '.join(names)}"
        for name, cell in zip(names, cells, strict=True):
            try:
                float(cell)
            except ValueError:
                return f"line {number}, column {name}: {cell.strip()!r} is not a number"
    return "cannot be read as a table of numbers"
