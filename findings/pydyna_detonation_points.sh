#!/bin/sh
# Points of detonation in an LS-DYNA deck (*INITIAL_DETONATION) through ansys-dyna-core 0.12.1 (PyDyna). A line is a point:
# explosive's part (0: all of them), place, time. A second line belongs to a point only where the part is -1, an acoustic
# boundary. PyDyna reads the second line always as that of the acoustic boundary, so of two points under one keyword the
# second turns into "peak" and "decay" of the first; and it writes such a line always, so one point written from Python is
# followed by a line of blanks and zeros, which a reader of lines takes for a second point: all parts, at the origin, at
# time 0. What LS-DYNA itself makes of that line was not tried.
# Seen: peak 2, decay 5 for the point at x = 5 of part 2; two lines written for one point. Fails where that changes.
set -eu
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/env"
"$folder/env/bin/pip" install --quiet ansys-dyna-core==0.12.1

"$folder/env/bin/python" - <<'PYTHON'
from ansys.dyna.core import Deck, keywords

line = "{:>10}{:>10}{:>10}{:>10}{:>10}\n".format
deck = Deck()
deck.loads("*KEYWORD\n*INITIAL_DETONATION\n" + line(1, 0.0, 0.0, 0.0, 0.0) + line(2, 5.0, 0.0, 0.0, 1e-5) + "*END\n")
points = list(deck.get_kwds_by_type("INITIAL"))
print("points read:", [(point.pid, point.x, point.peak, point.decay) for point in points])
assert [(point.pid, point.x, point.peak, point.decay) for point in points] == [(1, 0.0, 2.0, 5.0)], "changed: two points are read"

text = keywords.InitialDetonation(pid=1, x=1.0, y=2.0, z=3.0, lt=4e-6).write()
print(text)
lines = [row for row in text.splitlines()[1:] if not row.startswith("$")]
assert len(lines) == 2 and lines[1].split() == ["0.0", "0.0", "0.0", "0"], "changed: one line is written for one point"
PYTHON
echo "as described: the second point is lost in reading, and a line too many is written"
