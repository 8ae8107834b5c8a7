"""A table as it stands in its file: rows of cells with their lines, and what was concluded while it was read."""

from __future__ import annotations

import codecs
import csv
import io
import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from fragfield.errors import InputError
from fragfield_base.errors import names_allowed
from fragfield_base.reading import read_bytes

if TYPE_CHECKING:
    from collections.abc import Sequence
    from pathlib import Path


MOST_BYTES = 1 << 26
MOST_COLUMNS = 1000
MOST_CELLS = 5_000_000

DATE = re.compile(
    r"\d{1,4}[./-]\d{1,2}[./-]\d{2,4}(?:[ T]\d{1,2}:\d{2}.*)?"
    r"|\d{1,2}[.\-/ ]{1,2}(?:jan|feb|m[aä]r|mrz|apr|ma[iy]|jun|jul|aug|sep|o[ck]t|nov|de[cz])[a-z]*\.?(?:[ \-]\d{2,4})?"
    r"|(?:jan|feb|m[aä]r|mrz|apr|ma[iy]|jun|jul|aug|sep|o[ck]t|nov|de[cz])[a-z]*\.?[ \-]\d{1,4}",
    re.IGNORECASE,
)
"""What a spreadsheet shows where it took a number or a range for a date."""


class Guess(NamedTuple):
    """Something that was concluded from a file: what, its value, and the reason."""

    what: str
    value: str
    reason: str

    def __str__(self) -> str:
        return f"{self.what}: {self.value} ({self.reason})"


class QuestionError(InputError):
    """Something in a table has two meanings that differ by a factor; the caller is asked.

    Attributes
    ----------
    option : str
        Name of the argument of `import_table` that answers, as "decimal" or "unit".
    choices : tuple of str
        Its values, where they can be listed.
    """

    def __init__(self, message: str, option: str, choices: Sequence[str] = ()) -> None:
        flag = " or ".join(f"--{option} {choice}" for choice in choices) or f"--{option}"
        super().__init__(f"{message}; say which: {flag}")
        self.option, self.choices = option, tuple(choices)


class Refused(NamedTuple):
    """A cell that holds what a spreadsheet made of a number."""

    text: str
    reason: str


Cell = str | float | Refused
"""A text (not yet a number), a number of a workbook, or what is refused where a number is needed."""


class Row(NamedTuple):
    """Cells of one line, counted from 1."""

    line: int
    cells: list[Cell]


@dataclass
class Sheet:
    """Rows that are not empty, comments, and conclusions about the file."""

    path: Path
    """The file."""
    name: str
    """Of the sheet of a workbook; empty for a text."""
    rows: list[Row]
    """In the order of the file."""
    guesses: list[Guess]
    """What was concluded, with reasons."""
    comments: list[str] = field(default_factory=list)
    """Lines that begin with #, without it."""

    def place(self, line: int, column: int | None = None) -> str:
        """Where a cell stands, for messages."""
        if not self.name:
            return f"{self.path}: line {line}" + ("" if column is None else f", cell {column + 1}")
        where = f"row {line}" if column is None else f"cell {letter(column)}{line}"
        return f"{self.path}: sheet {self.name!r}, {where}"


def letter(column: int) -> str:
    """Letters of a column of a workbook, counted from 0: A, B, ..., Z, AA."""
    text = ""
    column += 1
    while column:
        column, rest = divmod(column - 1, 26)
        text = chr(65 + rest) + text
    return text


def stripped(cell: Cell) -> Cell:
    """A cell without the spaces and line breaks that stand around and in its text."""
    return re.sub(r"\s+", " ", cell.replace("\ufeff", "")).strip() if isinstance(cell, str) else cell


def checked_size(path: Path, rows: int, columns: int) -> None:
    """Refuse a table that is larger than any of a test."""
    if columns > MOST_COLUMNS:
        raise InputError(f"{path}: a row has more than {MOST_COLUMNS} cells; allowed: at most {MOST_COLUMNS} columns")
    if rows * columns > MOST_CELLS:
        raise InputError(f"{path}: more than {MOST_CELLS} cells; allowed: at most {MOST_CELLS}")


SEPARATORS = {"tab": "\t", "semicolon": ";", "bar": "|", "comma": ","}
"""What may stand between cells; the first of them that most lines have divides them, since decimals have commas."""
COMMENT = ("#", "%", "//")
"""What a line begins with that is no row."""
_MARKS = {codecs.BOM_UTF8: "utf-8", codecs.BOM_UTF16_LE: "utf-16", codecs.BOM_UTF16_BE: "utf-16"}
_LOST = "a date, what a spreadsheet makes of entries such as 3.5 or 5-10: the number is lost"


def read_text_file(path: Path, encoding: str | None = None, separator: str | None = None) -> Sheet:
    """Read a text file as rows of cells.

    Raises InputError: no such file, not a text, too large, or nothing in it; `QuestionError` where it is not Unicode
    and no encoding is given.
    """
    data = read_bytes(path, InputError, most=MOST_BYTES)
    found, reason = next(
        ((name, "byte-order mark") for mark, name in _MARKS.items() if data.startswith(mark)), ("", "")
    )
    found, reason = (encoding, "as given") if encoding else (found or "utf-8", reason or "valid UTF-8")
    if found == "utf-8" and data[:10_000].count(0):
        raise InputError(f"{path}: not a text: it holds bytes of zero")
    try:
        text = data.decode(found).removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")
    except LookupError:
        raise InputError(
            f"{path}: encoding {found!r} is not known; allowed: utf-8, utf-16, cp1252, latin-1 ..."
        ) from None
    except UnicodeError as fault:
        if encoding or reason == "byte-order mark":
            raise InputError(f"{path}: not text in {found} ({fault})") from None
        raise QuestionError(f"{path}: not text in UTF-8", "encoding", ("cp1252", "latin-1", "mac_roman")) from None
    lines = text.split("\n")
    declared = re.fullmatch(r'"?sep=(.)"?\s*', lines[0], flags=re.IGNORECASE)
    if separator is not None:
        if separator not in SEPARATORS:
            raise InputError(f"{path}: separator {separator!r}{names_allowed(separator, SEPARATORS)}")
        name, why = separator, "as given"
    elif declared and declared[1] in SEPARATORS.values():
        name, why = next(one for one, mark in SEPARATORS.items() if mark == declared[1]), f"the line {lines[0].strip()}"
    else:
        held = [line for line in lines[:400] if line.strip() and not line.lstrip().startswith(COMMENT)]
        name = next((one for one, mark in SEPARATORS.items() if 2 * sum(mark in line for line in held) > len(held)), "")
        name, why = name or "comma", "in most of its lines" if name else "a single column"
    rows, comments = _rows(path, text, SEPARATORS[name], 1 if declared else 0)
    if not rows:
        raise InputError(f"{path}: no table in it, only {'comments' if comments else 'empty lines'}")
    return Sheet(path, "", rows, [Guess("encoding", found, reason), Guess("separator", name, why)], comments)


def _rows(path: Path, text: str, separator: str, skip: int) -> tuple[list[Row], list[str]]:
    """Rows that hold something, and comments; a quoted cell may go over several lines."""
    rows: list[Row] = []
    comments: list[str] = []
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=separator)
    line, number = 1, 0
    try:
        for texts in reader:
            cells, at, line = [str(stripped(one)) for one in texts], line, reader.line_num + 1
            if at <= skip or not any(cells):
                continue
            if cells[0].startswith(COMMENT):
                comments.append(separator.join(cells).lstrip("#%/ ").rstrip(f"{separator} "))
                continue
            number += len(cells)
            checked_size(path, 1, len(cells))
            checked_size(path, number // MOST_COLUMNS, MOST_COLUMNS)
            rows.append(Row(at, [Refused(one, _LOST) if DATE.fullmatch(one) else one for one in cells]))
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num}: {error}") from None
    return rows, comments
