#!/bin/sh
# A cell with an error (#DIV/0!, #N/A) is not empty: somebody's formula failed there. Of an XLSX python-calamine 0.9.1
# gives it as "", as it gives a cell without content; openpyxl 3.1.5 gives the text of the error. A column of counts in
# which one formula failed is then a column with a gap, and what sums it up is short by that cell without a word.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet openpyxl==3.1.5 python-calamine==0.9.1

"$folder/env/bin/python" - "$folder/count.xlsx" <<'PYTHON'
import sys

import openpyxl
import python_calamine

book = openpyxl.Workbook()
for row in (["zone", "number"], ["0-90", 3], ["90-120", "#DIV/0!"], ["120-150", "#N/A"], ["150-180", None]):
    book.active.append(row)
assert [book.active.cell(row, 2).data_type for row in (3, 4)] == ["e", "e"]
book.save(sys.argv[1])

theirs = [row[1] for row in python_calamine.CalamineWorkbook.from_path(sys.argv[1]).get_sheet_by_index(0).to_python()]
others = [row[1].value for row in openpyxl.load_workbook(sys.argv[1], data_only=True).active.iter_rows()]
print("python-calamine 0.9.1:", theirs)
print("openpyxl 3.1.5:       ", others)
assert theirs == ["number", 3.0, "", "", ""], "changed: error cells are distinguished from empty ones"
assert others == ["number", 3, "#DIV/0!", "#N/A", None]
PYTHON
echo "as described: errors of cells are read as empty cells"
