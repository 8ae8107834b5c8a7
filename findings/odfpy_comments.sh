#!/bin/sh
# A comment of a cell is part of the text that odfpy 1.4.1 extracts from the cell, without a sign between them: the cell
# "900" with the comment "1" is "1900", and the heading "number" with the comment "per quadrant" another heading.
# Seen: 1900 and "per quadrantnumber". Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet setuptools==75.6.0 wheel==0.45.1
"$folder/env/bin/pip" install --quiet --no-build-isolation odfpy==1.4.1 defusedxml==0.7.1
cd "$folder"
"$folder/env/bin/python" - <<'PYTHON'
from importlib.metadata import version

from odf import teletype
from odf.office import Annotation
from odf.opendocument import OpenDocumentSpreadsheet, load
from odf.table import Table, TableCell, TableRow
from odf.text import P

document, table, row = OpenDocumentSpreadsheet(), Table(name="Arena"), TableRow()
document.spreadsheet.addElement(table)
table.addElement(row)
for text, comment in (("number", "per quadrant"), ("900", "1"), ("900", "")):
    cell = TableCell(valuetype="string")
    if comment:
        note = Annotation()
        note.addElement(P(text=comment))
        cell.addElement(note)
    cell.addElement(P(text=text))
    row.addElement(cell)
document.save("commented.ods")
cells = [teletype.extractText(cell) for cell in load("commented.ods").spreadsheet.getElementsByType(TableCell)]
print(f"odfpy {version('odfpy')}: {cells}")
assert cells == ["per quadrantnumber", "1900", "900"], "the behaviour has changed"
PYTHON
