"""A table as it stands in its file: rows of cells with their lines, from a text, XLSX or ODS."""

from __future__ import annotations

import csv
import datetime as dt
import io
import re
import warnings
import zipfile
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple
from xml.etree.ElementTree import Element

from fragfield.errors import InputError
from fragfield_base.errors import names_allowed
from fragfield_base.reading import parsed_xml, read_bytes

_MOST_BYTES = 1 << 26
_MOST_UNPACKED = 1 << 28
_MOST_COLUMNS = 1000
_MOST_CELLS = 5_000_000
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
    """Read the cells of a text, or of one sheet of an XLSX or ODS workbook.

    Raises InputError: no such file, another format, damaged, too large, or nothing in it; `QuestionError` where a text
    is not Unicode and no encoding is given, or several sheets hold something and none is named.
    """
    data = read_bytes(path, InputError, most=_MOST_BYTES)
    is_workbook = path.suffix.lower() in (".xlsx", ".xlsm", ".ods", ".xls", ".xlsb", ".fods")
    if is_workbook or data.startswith((b"PK\x03\x04", b"\xd0\xcf\x11\xe0")):
        return _chosen(path, _workbook(path, data), sheet)
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
            elif cells := _filled(path, enumerate(_squeezed(one) for one in texts)):
                rows.append(Row(at, cells))
    except csv.Error as error:
        raise InputError(f"{path}: line {reader.line_num}: {error}") from None
    _check_size(path, rows)
    if not rows:
        raise InputError(f"{path}: no table in it, only {'comments' if comments else 'empty lines'}")
    guesses = [
        Guess("encoding", name, "as given" if encoding else "the file is valid in it"),
        Guess("separator", chosen, "as given" if separator else "in most lines" if likely else "a single column"),
    ]
    return Sheet(path, "", rows, guesses, comments)


def _squeezed(text: str) -> str:
    return re.sub(r"\s+", " ", text.replace("\ufeff", "")).strip()


def _filled(path: Path, cells: Iterable[tuple[int, Cell]]) -> list[Cell]:
    """Cells (column from 0, content) of a row, without those that are empty at its end."""
    row: list[Cell] = []
    for at, cell in cells:
        if cell == "":
            continue
        if at >= _MOST_COLUMNS:
            raise InputError(f"{path}: a row has more than 1000 cells; allowed: at most {_MOST_COLUMNS} columns")
        row += [""] * (at - len(row))
        row.append(cell)
    return row


def _check_size(path: Path, rows: Sequence[Row]) -> None:
    if sum(len(row.cells) for row in rows) > _MOST_CELLS:
        raise InputError(f"{path}: more than {_MOST_CELLS} cells; allowed: at most that")


class _Table(NamedTuple):
    """A sheet of a workbook, and how many of its rows and columns are hidden, of its cells have comments."""

    rows: list[Row]
    is_hidden: bool
    hidden_rows: int
    hidden_columns: int
    comments: int


def _chosen(path: Path, tables: dict[str, _Table], sheet: str | None) -> Sheet:
    names = [name for name, one in tables.items() if not one.is_hidden]
    filled = [name for name in names if tables[name].rows]
    hidden = ", ".join(repr(name) for name, one in tables.items() if one.is_hidden and one.rows)
    left_out = f"; hidden and left out: {hidden}" if hidden else ""
    if sheet is not None:
        if sheet not in names and sheet.isdigit() and 1 <= int(sheet) <= len(names):
            sheet = names[int(sheet) - 1]
        if sheet not in names:
            raise InputError(f"{path}: sheet {sheet!r}{names_allowed(sheet, names)}{left_out}")
        filled = [sheet] if sheet in filled else []
    if not filled:
        raise InputError(f"{path}: no cell of it holds anything{left_out}")
    if len(filled) > 1:
        raise QuestionError(f"{path}: {len(filled)} sheets hold something", "sheet", [repr(one) for one in filled])
    table = tables[filled[0]]
    _check_size(path, table.rows)
    guesses = [Guess("sheet", filled[0], ("as given" if sheet else "the only one that holds anything") + left_out)]
    for what, count, reason in (
        ("hidden rows", table.hidden_rows, "by a filter or by hand; they are read"),
        ("hidden columns", table.hidden_columns, "they are read"),
        ("comments", table.comments, "left out"),
    ):
        if count:
            guesses.append(Guess(what, str(count), reason))
    return Sheet(path, filled[0], table.rows, guesses)


def _workbook(path: Path, data: bytes) -> dict[str, _Table]:
    try:
        with zipfile.ZipFile(io.BytesIO(data)) as archive:
            entries = archive.infolist()
            if sum(entry.file_size for entry in entries) > _MOST_UNPACKED:
                raise InputError(f"{path}: unpacks to more than {_MOST_UNPACKED} bytes; allowed: at most that")
            for entry in entries:
                if entry.filename.endswith((".xml", ".rels")):
                    with archive.open(entry) as file:  # a document type stands before the first element
                        head = file.read(1 << 16)
                    if b"<!DOCTYPE" in head or b"<!ENTITY" in head or head.startswith((b"\xff\xfe", b"\xfe\xff")):
                        raise InputError(
                            f"{path}: {entry.filename} declares a document type, which no spreadsheet writes"
                        )
            names = archive.namelist()
            content = archive.read("content.xml") if "content.xml" in names else b""
    except InputError:
        raise
    except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError, EOFError, ValueError) as fault:
        old = data.startswith(b"\xd0\xcf\x11\xe0")
        what = "an old or encrypted Excel workbook; save it as .xlsx without a password" if old else str(fault)
        raise InputError(f"{path}: not a workbook in XLSX or ODS ({what})") from None
    if "xl/workbook.xml" not in names and not content:
        raise InputError(f"{path}: an archive, but no workbook in XLSX or ODS")
    try:
        return _ods(path, content) if content else _xlsx(path, data)
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged file ends in errors of many kinds
        raise InputError(f"{path}: damaged, or not as spreadsheets write XLSX or ODS ({error})") from None


def _xlsx(path: Path, data: bytes) -> dict[str, _Table]:
    try:
        import openpyxl
    except ModuleNotFoundError:
        install = "pip install fragfield[tables]"
        raise InputError(f"{path}: reading XLSX needs openpyxl, which is not installed: {install}") from None
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of parts that hold no cells
        values, formulas = (
            openpyxl.load_workbook(io.BytesIO(data), data_only=data_only, keep_links=False)
            for data_only in (True, False)
        )
    tables = {}
    for sheet in values.worksheets:
        written = formulas[sheet.title]
        lines: dict[int, list[tuple[int, Cell]]] = {}
        comments = 0
        for (line, column), cell in sorted(
            sheet._cells.items()
        ):  # those that the file has: iter_rows makes all between
            formula = written._cells[line, column].value
            comments += cell.comment is not None
            lines.setdefault(line, []).append((column - 1, _value(cell.value, formula)))
        rows = [Row(line, cells) for line, held in lines.items() if (cells := _filled(path, held))]
        width = max((len(row.cells) for row in rows), default=0)
        columns = sum(
            max(min(one.max or 1, width) - (one.min or 1) + 1, 0)
            for one in sheet.column_dimensions.values()
            if one.hidden
        )
        hidden_rows = sum(one.hidden for one in sheet.row_dimensions.values())
        tables[sheet.title] = _Table(rows, sheet.sheet_state != "visible", hidden_rows, columns, comments)
    return tables


def _value(value: object, formula: object) -> Cell:
    if value is None:
        is_formula = isinstance(formula, str) and formula.startswith("=")
        return Refused(str(formula), _UNCOMPUTED) if is_formula else ""
    if isinstance(value, dt.datetime | dt.date | dt.time | dt.timedelta):
        return Refused(str(value), _LOST)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return float(value)
    return _squeezed(str(value))


_ODF = "{urn:oasis:names:tc:opendocument:xmlns:%s:1.0}"
_TABLE, _OFFICE, _STYLE, _WORDS = (_ODF % one for one in ("table", "office", "style", "text"))


def _ods(path: Path, content: bytes) -> dict[str, _Table]:
    document = parsed_xml(content, f"{path}: content.xml", InputError)
    styles = {
        style.get(f"{_STYLE}name")
        for style in document.iter(f"{_STYLE}style")
        if any(one.get(f"{_TABLE}display") == "false" for one in style)
    }
    tables = {}
    for sheet in document.iter(f"{_TABLE}table"):
        name = sheet.get(f"{_TABLE}name", "")
        rows: list[Row] = []
        line, hidden_rows = 1, 0
        for row in sheet.iter(f"{_TABLE}table-row"):
            times = int(row.get(f"{_TABLE}number-rows-repeated", 1))
            if cells := _ods_cells(path, row):
                if times * len(cells) > _MOST_CELLS:
                    raise InputError(f"{path}: more than {_MOST_CELLS} cells; allowed: at most that")
                rows += [Row(line + step, cells) for step in range(times)]
                hidden_rows += times * (row.get(f"{_TABLE}visibility") in ("collapse", "filter"))
            line += times
        width = max((len(row.cells) for row in rows), default=0)
        columns = sum(
            int(column.get(f"{_TABLE}number-columns-repeated", 1))
            for column in sheet.iter(f"{_TABLE}table-column")
            if column.get(f"{_TABLE}visibility") in ("collapse", "filter")
        )
        # A copy of a linked workbook's sheet, called by its address, is never shown.
        is_hidden = sheet.get(f"{_TABLE}style-name") in styles or re.match(r"'(?:file|https?|smb):", name) is not None
        comments = sum(1 for _ in sheet.iter(f"{_OFFICE}annotation"))
        tables[name] = _Table(rows, is_hidden, hidden_rows, min(columns, width), comments)
    return tables


def _ods_cells(path: Path, row: Element) -> list[Cell]:
    cells: list[tuple[int, Cell]] = []
    at = 0
    for one in row:
        if one.tag not in (f"{_TABLE}table-cell", f"{_TABLE}covered-table-cell"):
            continue
        times = int(one.get(f"{_TABLE}number-columns-repeated", 1))
        cell = _ods_cell(one) if one.tag == f"{_TABLE}table-cell" else ""
        if cell != "":
            cells += [(at + step, cell) for step in range(min(times, _MOST_COLUMNS + 1))]
        at += times
    return _filled(path, cells)


def _ods_cell(cell: Element) -> Cell:
    kind = cell.get(f"{_OFFICE}value-type")
    # Paragraphs are lines; a comment or a drawing on the cell has its own, farther in.
    text = _squeezed("\n".join(_ods_words(one) for one in cell.findall(f"{_WORDS}p")))
    if kind in ("float", "currency"):
        return float(cell.get(f"{_OFFICE}value", "nan"))
    if kind == "percentage":
        return Refused(text, "a percentage")
    if kind in ("date", "time"):
        return Refused(text, _LOST)
    formula = cell.get(f"{_TABLE}formula")
    return Refused(formula, _UNCOMPUTED) if kind is None and formula else text or cell.get(f"{_OFFICE}string-value", "")


def _ods_words(element: Element) -> str:
    """Text of a paragraph, without the comments within it; its signs for spaces are spaces."""
    text = element.text or ""
    for one in element:
        inner = "" if one.tag == f"{_OFFICE}annotation" else " " if one.tag == f"{_WORDS}s" else _ods_words(one)
        text += inner + (one.tail or "")
    return text
