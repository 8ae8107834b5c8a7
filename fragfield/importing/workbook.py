"""The sheet of a workbook, XLSX or ODS: values of cells; what a spreadsheet made of numbers is not taken for them."""

from __future__ import annotations

import datetime as dt
import re
import xml.parsers.expat as expat
import zipfile
from collections import Counter
from io import BytesIO
from itertools import zip_longest
from typing import TYPE_CHECKING, Any, NamedTuple

from fragfield.errors import InputError
from fragfield.importing.sheet import (
    DATE,
    MOST_BYTES,
    MOST_COLUMNS,
    Cell,
    Guess,
    QuestionError,
    Refused,
    Row,
    Sheet,
    checked_size,
    stripped,
)  # fmt: skip
from fragfield_base.errors import names_allowed
from fragfield_base.reading import read_bytes

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Mapping
    from pathlib import Path


_MOST_UNPACKED = 1 << 28
_MOST_ROWS = 1_048_576
_LOST = "a date, what a spreadsheet makes of entries such as 3.5 or 5-10: the number is lost; enter it again as text"
_HIDDEN_ROW = re.compile(rb"""<(?:\w+:)?row\s[^>]*\bhidden=["'](?:1|true)["']""")
_HIDDEN_COLUMNS = re.compile(rb"""<(?:\w+:)?col\s[^>]*\bhidden=["'](?:1|true)["'][^>]*>""")
_SPAN = re.compile(rb"""\b(?:min|max)=["'](\d+)["']""")
_LINKED = re.compile(r"'(?:file|https?|smb):")
_UNCOMPUTED = "a formula without a value: open the workbook in a spreadsheet, let it compute, and save it"
_INSTALL = "pip install fragfield[tables]"


def is_workbook(path: Path) -> bool:
    """Whether a file is a workbook, or is called one."""
    if path.suffix.lower() in (".xlsx", ".xlsm", ".ods", ".xls", ".xlsb", ".fods"):
        return True
    try:
        if not path.is_file():
            return False
        with path.open("rb") as file:
            return file.read(4) in (b"PK\x03\x04", b"\xd0\xcf\x11\xe0")
    except OSError:
        return False


def read_workbook(path: Path, sheet: str | None = None) -> Sheet:
    """Read one sheet of a workbook.

    `path`: XLSX or ODS; `sheet`: its name, or its number from 1; needed where several sheets hold something. Raises
    InputError: no such file or sheet, another format, an archive that unpacks to more than 256 MB, XML with a document
    type or entities, or a library that is not installed. `QuestionError` where several sheets hold something.
    """
    data = read_bytes(path, InputError, most=MOST_BYTES)
    kind = _checked_archive(path, data)
    tables = _xlsx(path, data) if kind == "xlsx" else _ods(path, data)
    filled = {name: one.rows for name, one in tables.items() if one.rows and not one.is_hidden}
    hidden = ", ".join(repr(name) for name, one in tables.items() if one.rows and one.is_hidden)
    left_out = f"; hidden and left out: {hidden}" if hidden else ""
    name, reason = _chosen(path, filled, [name for name, one in tables.items() if not one.is_hidden], sheet, left_out)
    guesses = [Guess("sheet", name, reason + left_out)]
    for what, count, reason in (
        ("hidden rows", tables[name].hidden_rows, "by a filter or by hand; they are read"),
        ("hidden columns", tables[name].hidden_columns, "they are read"),
        ("comments", tables[name].comments, "left out"),
    ):
        if count:
            guesses.append(Guess(what, str(count), reason))
    return Sheet(path, name, filled[name], guesses)


class _Table(NamedTuple):
    """Rows of a sheet, whether it is hidden, how many of its rows and columns are, and its comments."""

    rows: list[Row]
    is_hidden: bool
    hidden_rows: int
    hidden_columns: int
    comments: int


def _chosen(
    path: Path, filled: Mapping[str, list[Row]], names: list[str], sheet: str | None, left_out: str
) -> tuple[str, str]:
    if sheet is not None:
        name = next((one for one in names if one == sheet), None)
        if name is None and sheet.isdigit() and 1 <= int(sheet) <= len(names):
            name = names[int(sheet) - 1]
        if name is None:
            raise InputError(f"{path}: sheet {sheet!r}{names_allowed(sheet, names)}{left_out}")
        if name not in filled:
            raise InputError(f"{path}: sheet {name!r} is empty")
        return name, "as given"
    if not filled:
        raise InputError(f"{path}: no cell of it holds anything{left_out}")
    if len(filled) > 1:
        raise QuestionError(f"{path}: {len(filled)} sheets hold something", "sheet", [repr(one) for one in filled])
    return next(iter(filled)), "the only one that holds anything"


def _checked_archive(path: Path, data: bytes) -> str:
    """Refuse what is no workbook, unpacks to too much, or has XML that refers to entities."""
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive:
            entries = archive.infolist()
            if sum(entry.file_size for entry in entries) > _MOST_UNPACKED:
                raise InputError(f"{path}: unpacks to more than {_MOST_UNPACKED} bytes; allowed: at most that")
            names = {entry.filename for entry in entries}
            for entry in entries:
                if entry.filename.endswith((".xml", ".rels")) and _has_entities(archive, entry):
                    raise InputError(f"{path}: {entry.filename} declares a document type, which no spreadsheet writes")
    except InputError:
        raise
    except (zipfile.BadZipFile, OSError, RuntimeError, NotImplementedError, EOFError, ValueError) as fault:
        old = data.startswith(b"\xd0\xcf\x11\xe0")
        what = "an old or encrypted Excel workbook; save it as .xlsx without a password" if old else str(fault)
        raise InputError(f"{path}: not a workbook in XLSX or ODS ({what})") from None
    if "xl/workbook.xml" in names:
        return "xlsx"
    if "content.xml" in names:
        return "ods"
    raise InputError(f"{path}: an archive, but no workbook in XLSX or ODS")


def _check_whole(path: Path, data: bytes) -> None:
    """Refuse a cut or damaged content.xml, of which odfpy would read the first part in silence."""
    parser = expat.ParserCreate()

    def refuse(*_: object) -> None:
        raise InputError(f"{path}: content.xml declares entities, which no spreadsheet writes")

    parser.EntityDeclHandler = refuse
    try:
        with zipfile.ZipFile(BytesIO(data)) as archive, archive.open("content.xml") as file:
            parser.ParseFile(file)
    except (expat.ExpatError, zipfile.BadZipFile) as fault:
        raise InputError(f"{path}: damaged: content.xml is no whole XML ({fault})") from None


def _has_entities(archive: zipfile.ZipFile, entry: zipfile.ZipInfo) -> bool:
    """A document type stands before the first element; XML in UTF-16, which would hide it, is refused as well."""
    with archive.open(entry) as file:
        head = file.read(1 << 16)
    return b"<!DOCTYPE" in head or b"<!ENTITY" in head or head.startswith((b"\xff\xfe", b"\xfe\xff"))


def _xlsx(path: Path, data: bytes) -> dict[str, _Table]:
    """Sheets of an XLSX file: values as the spreadsheet computed them."""
    try:
        import openpyxl
    except ModuleNotFoundError:
        raise InputError(f"{path}: reading XLSX needs openpyxl, which is not installed: {_INSTALL}") from None
    try:
        values = openpyxl.load_workbook(BytesIO(data), read_only=True, data_only=True)
        formulas = openpyxl.load_workbook(BytesIO(data), read_only=True, data_only=False)
        found: dict[str, _Table] = {}
        for table in values.worksheets:
            written = formulas[table.title]
            for sheet in (table, written):
                sheet.reset_dimensions()  # what the file claims, which may be all of a sheet
            both = zip(table.iter_rows(), written.iter_rows(), strict=False)
            with zipfile.ZipFile(BytesIO(data)) as archive:
                xml = archive.read(table._worksheet_path)
                comments = _xlsx_comments(archive, table._worksheet_path)
            rows = _rows(path, (_paired(*pair) for pair in both))
            spans = [[int(end) for end in _SPAN.findall(one)] for one in _HIDDEN_COLUMNS.findall(xml)]
            width = max((len(row.cells) for row in rows), default=0)
            columns = sum(max(min(max(span), width) - min(span) + 1, 0) for span in spans if span)
            is_hidden = table.sheet_state != "visible"
            found[table.title] = _Table(rows, is_hidden, len(_HIDDEN_ROW.findall(xml)), columns, comments)
        return found
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged file ends in errors of many kinds
        raise InputError(f"{path}: damaged, or not as spreadsheets write XLSX ({error})") from None


def _xlsx_comments(archive: zipfile.ZipFile, sheet: str) -> int:
    """How many comments a sheet has, by the parts that it refers to."""
    folder, _, name = sheet.rpartition("/")
    links = f"{folder}/_rels/{name}.rels"
    text = archive.read(links).decode("utf-8", "replace") if links in archive.namelist() else ""
    parts = {name.rpartition("/")[2]: name for name in archive.namelist()}
    named = {one for one in re.findall(r"""Target=["'](?:[^"']*/)?(comment[^"'/]*\.xml)["']""", text) if one in parts}
    return sum(len(re.findall(rb"<(?:\w+:)?comment\s", archive.read(parts[one]))) for one in named)


def _paired(values: Iterable[Any], formulas: Iterable[Any]) -> tuple[int | None, list[Cell]]:
    """Line that the cells of a row name, and what they hold.

    A row need not say its number; the library counts the rows that are written, though their cells say theirs.
    """
    line: int | None = None
    cells: list[Cell] = []
    for value, formula in zip_longest(values, formulas):
        line = getattr(value, "row", line)
        held = None if value is None else value.value
        written = None if formula is None else formula.value
        if held is None and isinstance(written, str) and written.startswith("="):
            cells.append(Refused(written, _UNCOMPUTED))
        else:
            cells.append(_cell(held))
    return line, cells


def _cell(value: object) -> Cell:
    if value is None:
        return ""
    if isinstance(value, dt.datetime | dt.date | dt.time | dt.timedelta):
        return Refused(str(value), _LOST)
    if isinstance(value, bool):
        return str(value)
    if isinstance(value, int | float):
        return float(value)
    text = stripped(str(value))
    return Refused(str(text), _LOST) if DATE.fullmatch(str(text)) else text


def _rows(path: Path, lines: Iterable[tuple[int | None, list[Cell]]]) -> list[Row]:
    """Rows that hold something, by the lines that they name, or as they follow each other."""
    rows: list[Row] = []
    number = 0
    for count, (named, cells) in enumerate(lines, 1):
        line = count if named is None else named
        kept: list[Cell] = []
        for at, cell in enumerate(cells):
            if cell == "":
                continue
            if at >= MOST_COLUMNS:
                checked_size(path, 1, at + 1)
            kept += [""] * (at - len(kept))
            kept.append(cell)
        if kept:
            number += len(kept)
            if number > MOST_COLUMNS:
                checked_size(path, 1 + number // MOST_COLUMNS, MOST_COLUMNS)
            rows.append(Row(line, kept))
    return rows


def _ods(path: Path, data: bytes) -> dict[str, _Table]:
    """Sheets of an ODS file."""
    try:
        from odf.office import Annotation
        from odf.opendocument import load
        from odf.style import Style, TableProperties
        from odf.table import Table, TableColumn, TableRow
    except ModuleNotFoundError:
        raise InputError(f"{path}: reading ODS needs odfpy, which is not installed: {_INSTALL}") from None
    _check_whole(path, data)
    try:
        document = load(BytesIO(data))
        comments: Counter[str] = Counter()
        for table in document.spreadsheet.getElementsByType(Table):
            for note in table.getElementsByType(Annotation):  # whose text would be its cell's
                note.parentNode.removeChild(note)
                comments[str(table.getAttribute("name"))] += 1
        hidden = {
            style.getAttribute("name")
            for style in document.automaticstyles.getElementsByType(Style)
            for properties in style.getElementsByType(TableProperties)
            if str(properties.getAttribute("display")) == "false"
        }
        found: dict[str, _Table] = {}
        for table in document.spreadsheet.getElementsByType(Table):
            name = str(table.getAttribute("name"))
            # A copy of a linked workbook's sheet, called by its address, is never shown.
            is_hidden = table.getAttribute("stylename") in hidden or _LINKED.match(name) is not None
            rows = table.getElementsByType(TableRow)
            hidden_rows = sum(
                int(row.getAttribute("numberrowsrepeated") or 1)
                for row in rows
                if row.getAttribute("visibility") in ("collapse", "filter") and any(_ods_cells(path, row))
            )
            columns = sum(
                int(column.getAttribute("numbercolumnsrepeated") or 1)
                for column in table.getElementsByType(TableColumn)
                if column.getAttribute("visibility") in ("collapse", "filter")
            )
            lines = _rows(path, _ods_lines(path, rows))
            width = max((len(row.cells) for row in lines), default=0)
            found[name] = _Table(lines, is_hidden, hidden_rows, min(columns, width), comments[name])
        return found
    except InputError:
        raise
    except Exception as error:  # noqa: BLE001 - a damaged file ends in errors of many kinds
        raise InputError(f"{path}: damaged, or not as spreadsheets write ODS ({error})") from None


def _ods_lines(path: Path, rows: Iterable[Any]) -> Iterator[tuple[None, list[Cell]]]:
    """Lines of a sheet; what is repeated stands once in the file, empty ends of sheets a million times."""
    line = 0
    for row in rows:
        times = int(row.getAttribute("numberrowsrepeated") or 1)
        cells = _ods_cells(path, row)
        if not any(cell != "" for cell in cells):
            line += times
            if line <= _MOST_ROWS:
                yield from ((None, []) for _ in range(times))
            continue
        line += times
        checked_size(path, line, max(len(cells), 1))
        for _ in range(times):
            yield None, cells


def _ods_cells(path: Path, row: Any) -> list[Cell]:  # noqa: ANN401 - of odfpy
    cells: list[Cell] = []
    waiting = 0
    for child in row.childNodes:
        name = child.qname[1] if hasattr(child, "qname") else ""
        if name not in ("table-cell", "covered-table-cell"):
            continue
        times = int(child.getAttribute("numbercolumnsrepeated") or 1)
        cell = "" if name == "covered-table-cell" else _ods_cell(child)
        if cell == "":
            waiting += times
            continue
        checked_size(path, 1, len(cells) + waiting + times)
        cells += [""] * waiting + [cell] * times
        waiting = 0
    return cells


def _ods_cell(cell: Any) -> Cell:  # noqa: ANN401 - of odfpy
    from odf import teletype
    from odf.text import P

    kind = cell.getAttribute("valuetype")
    if kind in ("float", "currency", "percentage"):
        value = float(cell.getAttribute("value"))
        return Refused(f"{100.0 * value:g} %", "a percentage") if kind == "percentage" else value
    # Paragraphs are lines; a drawing that lies on the cell has its own, farther in.
    text = "\n".join(teletype.extractText(one) for one in cell.childNodes if getattr(one, "qname", "") == P().qname)
    if kind in ("date", "time"):
        return Refused(text, _LOST)
    if kind is None and cell.getAttribute("formula"):
        return Refused(str(cell.getAttribute("formula")), _UNCOMPUTED)
    return _cell(text or cell.getAttribute("stringvalue"))
