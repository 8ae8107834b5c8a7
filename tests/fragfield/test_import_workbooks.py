"""Tables in XLSX: what a spreadsheet made of a number, hidden sheets, damaged and hostile files."""

from __future__ import annotations

import io
import os
import re
import zipfile

import openpyxl
import pytest

import fragfield


def workbook(path, *sheets, change=None):
    book = openpyxl.Workbook()
    book.remove(book.active)
    for name, lines in sheets:
        sheet = book.create_sheet(name)
        for row in lines:
            sheet.append(row)
    if change:
        change(book)
    book.save(path)
    return path


HEAD = ["zone", "number", "mean mass (g)", "speed (m/s)"]


@pytest.mark.parametrize(
    ("sheets", "options", "message"),
    [
        ([("a", [HEAD, ["0-90", 3, 1.5, 800], ["90-180", 4, "=B2*2", 900]])], {},
         "sheet 'a', cell C3 (mean mass (g)): '=B2*2' is a formula without a value"),
        ([("a", [HEAD, ["0-90", 3, __import__("datetime").date(2024, 5, 3), 800]])], {},
         "'2024-05-03 00:00:00' is a date, what a spreadsheet makes of entries such as 3.5"),
        ([("a", [HEAD, ["0-90", 3, 1, 800]]), ("b", [HEAD, ["0-90", 3, 1, 800]])], {},
         "say which: --sheet 'a' or --sheet 'b'"),
        ([("a", [HEAD]), ("b", [])], {"sheet": "c"}, "sheet 'c' (allowed: a, b)"),
        ([("a", [HEAD, ["0-90", "#DIV/0!", 1, 800], ["90-180", 2, 1, 800]])], {}, "'#DIV/0!' is not a number"),
        ([("a", [])], {}, "no cell of it holds anything"),
    ],
)  # fmt: skip
def test_what_a_spreadsheet_made_of_a_number_is_refused(sheets, options, message, tmp_path):
    path = workbook(tmp_path / "t.xlsx", *sheets)
    with pytest.raises(fragfield.InputError) as found:
        fragfield.import_table(path, **options)
    assert message in str(found.value)


def test_a_sheet_by_name_beside_a_hidden_one(tmp_path):
    rows_ = [HEAD, ["0-90", 3, 1.5, 800], ["90-180", 4, 2.25, 900.5]]
    hide = lambda book: setattr(book["notes"], "sheet_state", "hidden")  # noqa: E731
    path = workbook(tmp_path / "t.xlsx", ("Daten", rows_), ("notes", rows_), change=hide)
    assert fragfield.import_table(path).summary["mass"] == pytest.approx(0.0135)
    assert fragfield.import_table(path, sheet="1").summary["mass"] == pytest.approx(0.0135)


def test_a_workbook_by_another_name_and_a_pipe(tmp_path):
    workbook(tmp_path / "t.xlsx", ("a", [HEAD, ["0-180", 3, 1.5, 800]])).rename(tmp_path / "t.csv")
    assert fragfield.import_table(tmp_path / "t.csv").summary["mass"] == pytest.approx(0.0045)
    os.mkfifo(tmp_path / "pipe.csv")
    with pytest.raises(fragfield.InputError, match="not a regular file"):
        fragfield.import_table(tmp_path / "pipe.csv")


def packed(path, replaced):
    """A workbook with some of its parts replaced."""
    workbook(path, ("a", [HEAD, ["0-180", 3, 1.5, 800]]))
    source = zipfile.ZipFile(io.BytesIO(path.read_bytes()))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for entry in source.namelist():
            target.writestr(entry, replaced.get(entry, source.read(entry)))
    return path


LAUGHS = b'<?xml version="1.0"?><!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><worksheet>&b;</worksheet>'


@pytest.mark.parametrize(
    ("replaced", "message"),
    [
        ({"xl/worksheets/sheet1.xml": LAUGHS}, "not a workbook that can be read|no cell of it holds anything"),
        ({"xl/worksheets/sheet1.xml": b"<worksheet"}, "not a workbook that can be read"),
        ({"xl/workbook.xml": b"<a/>"}, "no cell of it holds anything"),
    ],
)
def test_hostile_workbooks_are_refused_in_one_line(replaced, message, tmp_path):
    path = packed(tmp_path / "t.xlsx", replaced)
    with pytest.raises(fragfield.InputError) as found:
        fragfield.import_table(path)
    assert re.search(message, str(found.value))
    assert "\n" not in str(found.value)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("t.xlsx", b"PK\x03\x04" + b"x" * 100, "not a workbook that can be read"),
        ("t.xls", b"\xd0\xcf\x11\xe0" + b"x" * 100, "allowed: .xlsx without a password"),
        ("t.ods", b"no archive", "allowed: .xlsx without a password"),
    ],
)
def test_files_that_are_no_workbooks(name, content, message, tmp_path):
    (tmp_path / name).write_bytes(content)
    with pytest.raises(fragfield.InputError, match=message):
        fragfield.import_table(tmp_path / name)


def rewritten(path, part, change):
    """A workbook whose part `part` is changed as text."""
    source = zipfile.ZipFile(io.BytesIO(path.read_bytes()))
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as target:
        for entry in source.namelist():
            content = source.read(entry)
            target.writestr(entry, change(content.decode()).encode() if entry == part else content)
    return path


@pytest.mark.parametrize("cells", ["numbered", "not numbered"])
def test_lines_of_an_xlsx_whose_rows_lack_numbers(cells, tmp_path):
    """Rows need not name their number; where their cells do, an empty row before them counts."""
    rows = [HEAD, ["0-90", 3, 1.5, 800], [], [], ["90-180", 4, "many", 900]]
    path = workbook(tmp_path / "t.xlsx", ("a", rows))

    def unnumbered(text):
        text = re.sub(r'<row r="\d+"', "<row", text)
        return text if cells == "numbered" else re.sub(r'<c r="[A-Z]+\d+"', "<c", text)

    rewritten(path, "xl/worksheets/sheet1.xml", unnumbered)
    with pytest.raises(fragfield.InputError, match=f"cell C{5 if cells == 'numbered' else 3} "):
        fragfield.import_table(path)
