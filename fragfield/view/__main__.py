"""`python -m fragfield.view RUN FOLDER`: draw the pictures of a run in a process of their own, as the report does."""

from __future__ import annotations

import sys

from fragfield.errors import EXIT_INPUT, InputError
from fragfield.view.pictures import view_run

if __name__ == "__main__":
    try:
        view_run(*sys.argv[1:])
    except InputError as error:
        sys.stderr.write(f"{error}\n")
        sys.exit(EXIT_INPUT)
