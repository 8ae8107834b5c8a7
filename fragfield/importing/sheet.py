"""A table as it stands in its file: rows of cells with their lines, from a text or XLSX."""

from __future__ import annotations

import csv
import datetime as dt
import io
import re
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple

from fragfield.errors import InputError
from fragfield_base.errors import names_allowed
from fragfield_base.reading import read_bytes

_MOST_BYTES = 1 << 26
_MOST_COLUMNS = 1000
_LOST = "a date, what a spreadsheet makes of entries such as 3.5 or 5-10: the number is lost; enter it again as text"
_UNCOMPUTED = "a formula without a value: open the workbook in a spreadsheet, let it compute, and save it"
_SEPARATORS = {"tab": "\t", "semicolon": ";", "bar": "|", "comma": ","}  # the first that most lines have divides them


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
    """Rows that are not empty, conclusions about the file, and comments (lines that begin with #, without it)."""

    path: Path
    name: str
    """Of the sheet of a workbook; empty for a text."""
    rows: list[Row]
    guesses: list[Guess]
    comments: list[str] = field(default_factory=list)

    def place(self, line: int, column: int | None = None) -> str:
        """Where a cell stands, for messages."""
        if not self.name:
            return f"{self.path}: line {line}" + ("" if column is None else f", cell {column + 1}")
        where = f"row {line}" if column is None else f"cell {letter(column)}{line}"
        return f"{self.path}: sheet {self.name!r}, {where}"


def letter(column: int) -> str:
    """Letters of a column of a workbook, counted from 0: A, B, ..., Z, AA."""
    before, last = divmod(column, 26)
    return (letter(before - 1) if before else "") + chr(65 + last)


def read_sheet(
    path: Path, *, encoding: str | None = None, separator: str | None = None, sheet: str | None = None
) -> Sheet:
    """Read the cells of a text, or of one sheet of a workbook (XLSX).

    Raises InputError: no such file, another format, damaged, too large, or nothing in it; `QuestionError` where a text
    is not Unicode and no encoding is given, or several sheets hold something and none is named.
    """
    data = read_bytes(path, InputError, most=_MOST_BYTES)
    is_workbook = path.suffix.lower() in (".xlsx", ".xlsm", ".ods", ".xls", ".xlsb", ".fods")
    if is_workbook or data.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):
        return _workbook(path, data, sheet)
    return _text(path, data, encoding, separator)


def _text(path: Path, data: bytes, encoding: str | None, separator: str | None) -> Sheet:
    name = encoding or ("utf-16" if data.startswith((b"\xff\xfe", b"\xfe\xff")) else "utf-8")
    if name == "utf-8" and 0 in data[:10_000]:
        raise InputError(f"{path}: not a text: it holds bytes of zero")
    try:
        lines = io.StringIO(data.decode(name).removeprefix("\ufeff"), newline=None).read().split("\n")
    except LookupError:
        raise InputError(
            f"{path}: encoding {name!r} is not known; allowed: utf-8, utf-16, cp1252, latin-1 ..."
        ) from None
    except UnicodeError as fault:
        if encoding or name == "utf-16":
            raise InputError(f"{path}: not text in {name} ({fault})") from None
        raise QuestionError(f"{path}: not text in UTF-8", "encoding", ("cp1252", "latin-1", "mac_roman")) from None
    if separator is not None and separator not in _SEPARATORS:
        raise InputError(f"{path}: separator {separator!r}{names_allowed(separator, _SEPARATORS)}")
    declared = re.fullmatch(r'"?sep=([\t;|,])"?\s*', lines[0], flags=re.IGNORECASE)
    if declared:
        lines[0] = ""
    held = [line for line in lines[:400] if line.strip() and not line.startswith("#")]
    likely = [one for one, mark in _SEPARATORS.items() if declared and mark == declared[1]]
    likely += [one for one, mark in _SEPARATORS.items() if 2 * sum(mark in line for line in held) > len(held)]
    chosen = separator or next(iter(likely), "comma")
    rows: list[Row] = []
    comments: list[str] = []
    reader = csv.reader((f"{line}\n" for line in lines), delimiter=_SEPARATORS[chosen])
    first = 1
    try:
        for texts in reader:
            at, first = first, reader.line_num + 1
            if texts and texts[0].startswith("#"):
                comments.append(" ".join(texts).strip("# "))
            elif cells := _filled(path, map(_squeezed, texts)):
                rows.append(Row(at, cells))
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num}: {error}") from None
    if not rows:
        raise InputError(f"{path}: no table in it, only {'comments' if comments else 'empty lines'}")
    guesses = [
        Guess("encoding", name, "as given" if encoding else "the file is valid in it"),
        Guess("separator", chosen, "as given" if separator else "in most lines" if likely else "a single column"),
    ]
    return Sheet(path, "", rows, guesses, comments)


def _squeezed(text: str) -> str:
    return re.sub(r"\s+", " ", text.replace("\ufeff", "")).strip()


def _filled(path: Path, cells: Iterable[Cell]) -> list[Cell]:
    """Cells of a row, without those that are empty at its end."""
    row = list(cells)
    while row and row[-1] == "":
        row.pop()
    if len(row) > _MOST_COLUMNS:
        raise InputError(f"{path}: a row has {len(row)} cells; allowed: at most {_MOST_COLUMNS} columns")
    return row


def _workbook(path: Path, data: bytes, sheet: str | None) -> Sheet:
    try:
        import openpyxl
    except ModuleNotFoundError:
        install = "pip install fragfield[tables]"
        raise InputError(f"{path}: reading XLSX needs openpyxl, which is not installed: {install}") from None
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of parts that hold no cells
            values, formulas = (
                openpyxl.load_workbook(io.BytesIO(data), data_only=one, keep_links=False) for one in (True, False)
            )
    except Exception as fault:  # noqa: BLE001 - a damaged file ends in errors of many kinds
        words = " ".join(str(fault).split())
        raise InputError(
            f"{path}: not a workbook that can be read ({words}); allowed: .xlsx without a password, as every "
            "spreadsheet saves it"
        ) from None
    tables: dict[str, list[Row]] = {}
    for one in values.worksheets:
        written, lines = formulas[one.title], dict[int, list[Cell]]()
        for (line, column), cell in sorted(one._cells.items()):  # iter_rows makes all empty ones between
            row = lines.setdefault(line, [])
            row += [""] * (column - 1 - len(row))
            row.append(_value(cell.value, written._cells[line, column].value))
        tables[one.title] = [Row(line, row) for line, held in lines.items() if (row := _filled(path, held))]
    hidden = [one.title for one in values.worksheets if one.sheet_state != "visible"]
    names = [name for name in tables if name not in hidden]
    filled = [name for name in names if tables[name]]
    left_out = [repr(name) for name in hidden if tables[name]]
    words = f"; hidden and left out: {', '.join(left_out)}" if left_out else ""
    if sheet is not None:
        if sheet not in names and sheet.isdigit() and 1 <= int(sheet) <= len(names):
            sheet = names[int(sheet) - 1]
        if sheet not in names:
            raise InputError(f"{path}: sheet {sheet!r}{names_allowed(sheet, names)}{words}")
        filled = [sheet] if sheet in filled else []
    if not filled:
        raise InputError(f"{path}: no cell of it holds anything{words}")
    if len(filled) > 1:
        raise QuestionError(f"{path}: {len(filled)} sheets hold something", "sheet", [repr(one) for one in filled])
    reason = ("as given" if sheet else "the only one that holds anything") + words
    return Sheet(path, filled[0], tables[filled[0]], [Guess("sheet", filled[0], reason)])


def _value(value: object, formula: object) -> Cell:
    if value is None:
        is_formula = isinstance(formula, str) and formula.startswith("=")
        return Refused(str(formula), _UNCOMPUTED) if is_formula else ""
    if isinstance(value, dt.datetime | dt.date | dt.time | dt.timedelta):
        return Refused(str(value), _LOST)
    return float(value) if isinstance(value, int | float) and not isinstance(value, bool) else _squeezed(str(value))
