"""`python -m validation [NAME...] [--quick] [--json]`: run the cases, compare, print the table.

Exit code 0 when every check passed, 1 when one failed, 2 for bad input.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from validation.paper_3_1 import check as paper_3_1
from validation.readme import copy_figures, insert_tables
from validation.rows import print_rows

if TYPE_CHECKING:
    from collections.abc import Sequence

    from validation.rows import Row

CASES = {"paper_3_1": paper_3_1}
ROOT = Path(__file__).resolve().parent.parent
RUNS = ROOT / "runs" / "validation"


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the command line asks for and return the exit code."""
    options = _parser().parse_args(arguments)
    unknown = [name for name in options.names if name not in CASES]
    if unknown:
        print(f"validation: no case is named {unknown[0]!r}; there are {', '.join(CASES)}", file=sys.stderr)
        return 2
    rows: list[Row] = []
    for name in options.names or CASES:
        case = CASES[name]
        if options.run is not None:
            rows += case.check(_summary(options.run))
            continue
        sizes = (case.QUICK_SIZE,) if options.quick else case.SIZES
        summaries = {size: _run(name, case.REFERENCE["case"], size) for size in sizes}
        rows += case.check(summaries[sizes[-1]])
        if options.readme:
            finest = _folder(name, sizes[-1])
            insert_tables(case.readme_tables(summaries, finest / "burst_snapshot.h5"))
            copy_figures(finest / "figures", case.FIGURES, name)
    if options.json:
        print(json.dumps([row.as_dict() for row in rows], indent=1))
    else:
        print_rows(rows)
    return 1 if any(row.passed is False for row in rows) else 0


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m validation", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(CASES)}; all by default")
    parser.add_argument("--quick", action="store_true", help="coarse cells only")
    parser.add_argument("--json", action="store_true", help="rows as JSON on stdout")
    parser.add_argument("--readme", action="store_true", help="write the README's tables from the runs")
    parser.add_argument("--run", type=Path, metavar="DIR", help="compare this run instead of making one")
    return parser


def _run(name: str, case: str, size: str) -> dict[str, Any]:
    """Run a case at a cell size, always anew: what an earlier version left proves nothing of this one."""
    out = _folder(name, size)
    command = [sys.executable, "-m", "fragfield", "run", str(ROOT / case), "--cell-size", size, "--out", str(out)]
    done = subprocess.run([*command, "--overwrite"], cwd=ROOT, check=False, stdout=2)
    if done.returncode != 0:
        print(f"validation: {name} at {size} ended with exit code {done.returncode}", file=sys.stderr)
        sys.exit(done.returncode)
    return _summary(out)


def _folder(name: str, size: str) -> Path:
    return RUNS / f"{name}_{size.replace(' ', '_')}"


def _summary(folder: Path) -> dict[str, Any]:
    try:
        found: dict[str, Any] = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        print(f"validation: {folder} is not a finished run: {error}", file=sys.stderr)
        sys.exit(2)
    return found


if __name__ == "__main__":
    sys.exit(main())
