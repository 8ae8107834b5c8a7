"""`python -m validation [NAME...] [--quick] [--json]`: run the cases, compare, print the table.

Exit code 0 when every check passed, 1 when one failed, 2 for bad input, that of fragfield when a run failed.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

from validation.options import read_options
from validation.paper_3_1 import study as paper_3_1
from validation.paper_3_2 import study as paper_3_2
from validation.rows import print_rows
from validation.runs import FOLDER, Runs, StudyError

if TYPE_CHECKING:
    from collections.abc import Sequence

    from validation.rows import Row

CASES = {"paper_3_1": paper_3_1.study, "paper_3_2": paper_3_2.study}


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the command line asks for and return the exit code."""
    options = read_options(arguments, CASES, __doc__)
    unknown = [name for name in options.names if name not in CASES]
    if unknown:
        print(f"validation: no case is named {unknown[0]!r}; there are {', '.join(CASES)}", file=sys.stderr)
        return 2
    folder = options.out.resolve() if options.out else FOLDER
    runs = Runs(folder, resume=options.resume, threads=options.threads, ranks=options.ranks)
    rows: list[Row] = []
    try:
        for name in options.names or CASES:
            rows += CASES[name](options, runs)
    except StudyError as error:
        print(f"validation: {error}", file=sys.stderr)
        return error.code
    if options.json:
        print(json.dumps([row.as_dict() for row in rows], indent=1))
    else:
        print_rows(rows)
    return 1 if any(row.passed is False for row in rows) else 0


if __name__ == "__main__":
    sys.exit(main())
