"""Tables in XLSX and ODS: what a spreadsheet made of a number, hidden sheets, damaged and hostile files."""

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


def write_ods(path, rows):
    """A sheet as LibreOffice writes it, which ends in a million empty rows."""

    def cell(value):
        kind = "string" if isinstance(value, str) else f'float" office:value="{float(value)!r}'
        return f'<table:table-cell office:value-type="{kind}"><text:p>{value}</text:p></table:table-cell>'

    body = "".join(f"<table:table-row>{''.join(map(cell, row))}</table:table-row>" for row in rows)
    names = "".join(f' xmlns:{one}="urn:oasis:names:tc:opendocument:xmlns:{one}:1.0"' for one in PARTS)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("content.xml", (
            f'<office:document-content{names} xmlns:dc="http://purl.org/dc/elements/1.1/"><office:automatic-styles/>'
            f'<office:body><office:spreadsheet><table:table table:name="Blatt1">{body}<table:table-row '
            'table:number-rows-repeated="1048550"><table:table-cell table:number-columns-repeated="16384"/>'
            "</table:table-row></table:table></office:spreadsheet></office:body></office:document-content>"
        ))  # fmt: skip


PARTS = ("office", "table", "text", "style")
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
        ({"xl/worksheets/sheet1.xml": LAUGHS}, "xl/worksheets/sheet1.xml declares a document type"),
        ({"xl/worksheets/sheet1.xml": b" " * (1 << 28)}, "unpacks to more than 268435456 bytes"),
        ({"xl/worksheets/sheet1.xml": b"<worksheet"}, "damaged, or not as spreadsheets write XLSX"),
        ({"xl/workbook.xml": b"<a/>"}, "no cell of it holds anything"),
    ],
)
def test_hostile_workbooks_are_refused_in_one_line(replaced, message, tmp_path):
    path = packed(tmp_path / "t.xlsx", replaced)
    with pytest.raises(fragfield.InputError) as found:
        fragfield.import_table(path)
    assert message in str(found.value)
    assert "\n" not in str(found.value)


def test_a_cut_ods_is_refused_and_not_read_in_part(tmp_path):
    write_ods(tmp_path / "t.ods", [HEAD, ["0-90", 3, 1.5, 800]])
    source = zipfile.ZipFile(io.BytesIO((tmp_path / "t.ods").read_bytes()))
    with zipfile.ZipFile(tmp_path / "t.ods", "w") as target:
        for entry in source.namelist():
            content = source.read(entry)
            target.writestr(entry, content[: len(content) // 2] if entry == "content.xml" else content)
    with pytest.raises(fragfield.InputError, match=r"content\.xml: not well-formed XML"):
        fragfield.import_table(tmp_path / "t.ods")


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("t.xlsx", b"PK\x03\x04" + b"x" * 100, "not a workbook in XLSX or ODS"),
        ("t.xls", b"\xd0\xcf\x11\xe0" + b"x" * 100, "an old or encrypted Excel workbook; save it as .xlsx"),
        ("t.ods", b"no archive", "not a workbook in XLSX or ODS"),
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


COMMENT = (
    "<office:annotation><dc:creator>A</dc:creator><dc:date>2026-11-25T10:00:00</dc:date>"
    "<text:p>1</text:p><text:p>per quadrant</text:p></office:annotation>"
)


@pytest.mark.parametrize("where", ["before", "after", "within"])
def test_comments_of_an_ods_are_no_part_of_numbers_and_names(where, tmp_path):
    """In text cells and in the heads of columns, with author and date, as LibreOffice writes them."""
    write_ods(tmp_path / "t.ods", [HEAD, ["0-90", "3", "1.5", "800"], ["90-180", "900", "2.5", "900"]])

    def commented(text):
        for words in ("number", "900", "mean mass (g)"):
            cell = f"<text:p>{words}</text:p>"
            assert cell in text
            text = text.replace(
                cell,
                {
                    "before": COMMENT + cell,
                    "after": cell + COMMENT,
                    "within": f"<text:p>{words}{COMMENT}</text:p>",
                }[where],
            )
        return text

    table = fragfield.import_table(rewritten(tmp_path / "t.ods", "content.xml", commented))
    assert table.summary["pieces"] == 903
    assert table.summary["mass"] == pytest.approx(3 * 1.5e-3 + 900 * 2.5e-3)


def test_two_lines_of_a_cell_are_no_number(tmp_path):
    write_ods(tmp_path / "t.ods", [HEAD, ["0-90", "3", "1.5", "800"], ["90-180", "900", "2.5", "900"]])
    path = rewritten(tmp_path / "t.ods", "content.xml", lambda text: text.replace(
        "<text:p>900</text:p>", "<text:p>9</text:p><text:p>00</text:p>", 1))  # fmt: skip
    with pytest.raises(fragfield.InputError, match="'9 00'"):
        fragfield.import_table(path)


HIDDEN = (
    '<style:style style:name="hid" style:family="table"><style:table-properties table:display="false"/></style:style>'
)
OTHER = (
    '<table:table table:name="{name}"{style}><table:table-row><table:table-cell office:value-type="float" '
    'office:value="3"><text:p>3</text:p></table:table-cell></table:table-row></table:table></office:spreadsheet>'
)


@pytest.mark.parametrize(
    ("name", "style"), [("old", ' table:style-name="hid"'), ("'file:///C:/x/masses.ods'#$Sheet1", "")]
)
def test_hidden_sheets_and_copies_of_linked_files_are_left_out_of_an_ods_and_said(name, style, tmp_path):
    write_ods(tmp_path / "t.ods", [HEAD, ["0-90", 3, 1.5, 800], ["90-180", 4, 2.5, 900]])

    def with_other(text):
        text = re.sub(
            r"<office:automatic-styles/>", f"<office:automatic-styles>{HIDDEN}</office:automatic-styles>", text
        )
        return text.replace("</office:spreadsheet>", OTHER.format(name=name, style=style))

    path = rewritten(tmp_path / "t.ods", "content.xml", with_other)
    guess = fragfield.import_table(path).guesses[0]
    assert guess.value == "Blatt1"
    assert f"hidden and left out: {name!r}" in guess.reason


def test_hidden_rows_are_read_and_said(tmp_path):
    rows = [HEAD, ["0-90", 3, 1.5, 800], ["90-180", 4, 2.5, 900]]
    write_ods(tmp_path / "t.ods", rows)
    last = '<table:table-row><table:table-cell office:value-type="string"><text:p>90-180'
    rewritten(tmp_path / "t.ods", "content.xml", lambda text: text.replace(
        last, last.replace("row>", 'row table:visibility="filter">', 1)))  # fmt: skip
    workbook(tmp_path / "t.xlsx", ("a", rows), change=lambda book: setattr(book["a"].row_dimensions[3], "hidden", True))
    for name in ("t.ods", "t.xlsx"):
        table = fragfield.import_table(tmp_path / name)
        assert table.summary["pieces"] == 7
        assert "hidden rows: 1 (by a filter or by hand; they are read)" in map(str, table.guesses)


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
