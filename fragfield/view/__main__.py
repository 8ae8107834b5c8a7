"""Draws the pictures of a run: `python -m fragfield.view RUN FOLDER WIDE`, see `offscreen.drawing`."""

from __future__ import annotations

import sys
from pathlib import Path

from fragfield.errors import InputError
from fragfield.report.reading.run_files import read_run
from fragfield.view.offscreen import INPUT, use_offscreen
from fragfield.view.pictures import write_pictures

if __name__ == "__main__":
    use_offscreen()
    try:
        write_pictures(read_run(sys.argv[1], flown=False, case=False), Path(sys.argv[2]), wide=sys.argv[3] == "1")
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(INPUT)
