"""A table as it stands in its file: rows of cells with their lines, and what was concluded while it was read."""

from __future__ import annotations

import re
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, NamedTuple

from fragfield.errors import InputError

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
    decimal: str = ""
    """Of a text: "point", "comma", "either", "both" or ""; of a workbook ""."""

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
