#!/bin/sh
# Rows of an XLSX need not name their number (attribute r of <row>, optional in ECMA-376, 18.3.1.73), though their cells
# name theirs. openpyxl 3.1.5 puts such cells where they say, but in read-only mode it gives the rows that are written
# one after the other, and leaves the empty ones between them out: the n-th row of iter_rows is not row n of the sheet.
# Seen: row 5 of the sheet is the third of iter_rows in read-only mode, the fifth otherwise. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet openpyxl==3.1.5
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
import re
import zipfile

import openpyxl

book = openpyxl.Workbook()
for row in (["mass"], [1.5], [], [], [2.5]):
    book.active.append(row)
book.save("numbered.xlsx")
with zipfile.ZipFile("numbered.xlsx") as source, zipfile.ZipFile("plain.xlsx", "w") as target:
    for name in source.namelist():
        text = source.read(name)
        target.writestr(name, re.sub(rb'<row r="\d+"', b"<row", text) if name.startswith("xl/worksheets/") else text)


def rows(name, *, read_only):
    sheet = openpyxl.load_workbook(name, read_only=read_only).active
    if read_only:
        sheet.reset_dimensions()
    return [number for number, row in enumerate(sheet.iter_rows(values_only=True), 1) if any(row)]


found = {(name, mode): rows(name, read_only=mode) for name in ("numbered.xlsx", "plain.xlsx") for mode in (False, True)}
for (name, mode), numbers in found.items():
    print(f"openpyxl {openpyxl.__version__}: {name}, {'read-only' if mode else 'whole'}: filled rows {numbers}")
assert found.pop(("plain.xlsx", True)) == [1, 2, 3], "the behaviour has changed"
assert all(numbers == [1, 2, 5] for numbers in found.values()), "the behaviour has changed"
PYTHON
