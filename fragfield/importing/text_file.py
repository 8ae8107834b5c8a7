"""The sheet of a text file: CSV in any usual dialect."""

from __future__ import annotations

import csv
import io
from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield.importing.dialect import COMMENT, SEPARATORS, Guess, decoded, dialect_of
from fragfield.importing.sheet import (
    DATE,
    MOST_BYTES,
    MOST_COLUMNS,
    Cell,
    QuestionError,
    Refused,
    Row,
    Sheet,
    checked_size,
    stripped,
)  # fmt: skip
from fragfield_base.names import names_allowed
from fragfield_base.reading import read_bytes

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["SEPARATOR_NAMES", "read_text_file"]

SEPARATOR_NAMES = {name: mark for mark, name in SEPARATORS.items()}


def read_text_file(path: Path, encoding: str | None = None, separator: str | None = None) -> Sheet:
    """Read a text file as rows of cells.

    Raises
    ------
    InputError
        No such file, not a text, too large, or nothing in it; `QuestionError` where two separators fit equally well.
    """
    data = read_bytes(path, InputError, most=MOST_BYTES)
    try:
        text, found = decoded(data, encoding)
    except InputError as error:
        raise InputError(f"{path}: {error}") from None
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    mark = _mark(path, separator)
    try:
        dialect = dialect_of(text, found, mark)
    except InputError as error:
        what = str(error).split(";")[0]
        if "--separator" not in str(error):
            raise InputError(f"{path}: {what}") from None
        raise QuestionError(f"{path}: {what}", "separator", list(SEPARATOR_NAMES)) from None
    guesses = [found, Guess("separator", SEPARATORS[dialect.separator.value], dialect.separator.reason)]
    rows, comments = _rows(path, text, dialect.separator.value, dialect.skip)
    if not rows:
        raise InputError(f"{path}: no table in it, only {'comments' if comments else 'empty lines'}")
    return Sheet(path, "", rows, guesses, comments, dialect.decimal)


def _mark(path: Path, separator: str | None) -> str | None:
    if separator is None or separator in SEPARATORS:
        return separator
    if separator in SEPARATOR_NAMES:
        return SEPARATOR_NAMES[separator]
    raise InputError(f"{path}: separator {separator!r}{names_allowed(separator, SEPARATOR_NAMES)}")


def _rows(path: Path, text: str, separator: str, skip: int) -> tuple[list[Row], list[str]]:
    rows: list[Row] = []
    comments: list[str] = []
    number = 0
    for line, cells in _split(path, text, separator):
        if line <= skip or not any(cells):
            continue
        if cells[0].startswith(COMMENT):
            comments.append(separator.join(cells).lstrip("#%/ ").rstrip(f"{separator} "))
            continue
        if len(cells) > MOST_COLUMNS:
            checked_size(path, 1, len(cells))
        number += len(cells)
        rows.append(Row(line, [_cell(cell) for cell in cells]))
        if number > MOST_COLUMNS:
            checked_size(path, 1 + number // MOST_COLUMNS, MOST_COLUMNS)
    return rows, comments


def _split(path: Path, text: str, separator: str) -> list[tuple[int, list[str]]]:
    """Lines and cells; a quoted cell may go over several lines."""
    if separator == " ":
        return [(number, line.split()) for number, line in enumerate(text.split("\n"), 1)]
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    found: list[tuple[int, list[str]]] = []
    try:
        line = 1
        for cells in reader:
            found.append((line, [str(stripped(cell)) for cell in cells]))
            line = reader.line_num + 1
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num}: {error}") from None
    return found


def _cell(text: str) -> Cell:
    if text and DATE.fullmatch(text):
        return Refused(text, "a date, what a spreadsheet makes of entries such as 3.5 or 5-10: the number is lost")
    return text
