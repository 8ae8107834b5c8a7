"""`python -m validation [NAME...] [--quick] [--json] [--record]`: run the cases, compare, print the table.

Exit code 0 when every verification and every required trend passed, 1 when one failed or a result was not kept, 2 for
bad input, that of fragfield when a run failed, 4 for a fault in a study. A case that cannot go on does not keep the
others from being computed. `--record` keeps the rows of every case that came to its end, and writes the pages.
"""

from __future__ import annotations

import argparse
import json
import sys
import traceback
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.errors import EXIT_FAULT, EXIT_INPUT, nearest
from validation.readme import write_pages
from validation.record import EVIDENCE, RECORD, entry, read_record, reason_against, write_evidence, write_record
from validation.rows import Rows, print_rows
from validation.runs import FOLDER, Runs, StudyError

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["CASES", "Case", "main"]


@dataclass(frozen=True)
class Case:
    """Subjects of all rows of a case, and what it means for a distance."""

    subjects: tuple[str, ...]
    meaning: str


_STACK = ("burst", "stack", "three dimensions")
CASES = {
    "products": Case(
        ("burst",),
        "The energy of each product model closes, and what a charge gives a casing is within the printed Gurney "
        "velocities or a few per cent above them: speeds, and so distances, are not too small from this side.",
    ),
    "solid": Case(
        ("burst",),
        "The casing's mechanics follows the closed forms. It decides how energy is passed on, little of a distance.",
    ),
    "axisymmetric": Case(
        ("burst",),
        "The default cells give the mean speed of a single round to better than a distance can be known; meridian and "
        "three dimensions are the same burst but for the metal beside the fuze and the fastest cell.",
    ),
    "copper_cylinder": Case(
        ("burst",),
        "With the default products (landau_cj) speeds are those of the test; with the paper's (landau) they are a "
        "tenth too high. Distances vary by less than speeds.",
    ),
    "steel_tubes": Case(
        ("burst",),
        "The speed of the middle lies above Gurney's formula, the more the thinner the wall: slightly too far, never "
        "short.",
    ),
    "colliding_tubes": Case(
        ("burst", "collision"),
        "Between two rounds an independent code sends about as much metal along the plane between them: the focus of "
        "a stack comes from the mechanics, to about a tenth of its mass.",
    ),
    "stack_trends": Case(
        _STACK,
        "Gap, delay and number of rounds move the focus as geometry requires: arrangements may be compared.",
    ),
    "mean_mass": Case(
        ("break_up",),
        "The mean mass of a casing is known to a factor of about 1.6 either way: the largest single error of a number "
        "of fragments. It moves the distance much less (sensitivities).",
    ),
    "polar_zones": Case(
        ("burst", "break_up"),
        "The side spray is as wide and as dense as in the panel test with the default scatter of directions; the rear "
        "cone holds too few pieces, so behind a lying round distances may be short.",
    ),
    "paper_3_1": Case((), "The paper's single round is met within the tenth that the paper claims for itself."),
    "paper_3_2": Case(
        _STACK,
        "In the direction of the focus a pair sends several times the fragments of one round; the paper states no "
        "sector for its figure. Use the whole curve by direction, never one narrow sector.",
    ),
    "m107_1944": Case(
        (),
        "Flight alone repeats the table to 150 ft; from the burst there are a quarter more hazardous fragments than in "
        "1944, so that the distance is on the long side.",
    ),
    "peers": Case(
        ("flight",),
        "Two other programs fly the same fragments to the same places in the same air; what differs in the standard's "
        "air is in theirs. Paths and air add nothing to the error of a distance.",
    ),
    "attitudes": Case(
        ("burst", "break_up", "flight"),
        "The distance changes by some per cent with the cells and by less than a tenth with some degrees of lean; the "
        "envelope of all attitudes covers what the attitude does.",
    ),
    "sensitivities": Case(
        (),
        "[Ricochet](../docs/guide/ricochet.md), the mean mass of the fragments and the scatter of directions move a "
        "distance most; leakage, softening and heat no more than its statistical error.",
    ),
}
"""From theory to tests. Every name is a package here with a function `study(runs, rows)` in its module `study`."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the command line asks for and return the exit code."""
    options = _options(arguments)
    unknown = [name for name in options.names if name not in CASES]
    if unknown:
        hint = nearest(unknown[0], CASES)
        print(f"validation: no case is named {unknown[0]!r}{hint}; there are {', '.join(CASES)}", file=sys.stderr)
        return EXIT_INPUT
    runs = Runs(options.out.resolve(), resume=options.resume, threads=options.threads, ranks=options.ranks)
    computed: list[Rows] = []
    codes, kept = [], True
    for name in options.names or CASES:
        rows, code, stopped = _compute(name, runs, quick=options.quick)
        computed.append(rows)
        codes += [code] if code else []
        if options.record:
            kept &= _keep(rows, stopped)
    together = [row for rows in computed for row in rows]
    if options.json:
        print(json.dumps([row.as_dict() for row in together], indent=1))
    else:
        print_rows(together)
    return codes[0] if codes else int(not kept or not all(rows.sound for rows in computed))


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="python -m validation", description=__doc__)
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(CASES)}; all by default")
    parser.add_argument("--quick", action="store_true", help="coarse cells; only verification is judged")
    parser.add_argument("--json", action="store_true", help="rows as JSON on stdout")
    parser.add_argument("--record", action="store_true", help="keep the rows for the report, and write the pages")
    parser.add_argument("--resume", action="store_true", help="keep finished runs of the same case")
    parser.add_argument("--threads", type=int, metavar="N", help="threads of each rank of a run")
    parser.add_argument("--ranks", type=int, default=1, metavar="N", help="MPI ranks of a run")
    parser.add_argument("--out", type=Path, default=FOLDER, metavar="DIR", help="make the runs here")
    return parser.parse_args(arguments)


def _compute(name: str, runs: Runs, *, quick: bool) -> tuple[Rows, int, str | None]:
    """The rows of a case, the exit code that it asks for, and why it stopped; rows that there are already stay."""
    rows = Rows(name, CASES[name].subjects, quick=quick)
    try:
        import_module(f"validation.{name}.study").study(runs, rows)
        runs.check(rows)
    except StudyError as error:
        print(f"validation: {name}: {error}", file=sys.stderr)
        return rows, error.code, str(error)
    except Exception as error:  # noqa: BLE001 - of one study: the others, and what is recorded, must not suffer from it
        traceback.print_exc()
        print(f"validation: {name}: a fault after {len(rows)} rows", file=sys.stderr)
        return rows, EXIT_FAULT, f"{type(error).__name__}: {error}"
    finally:
        runs.bursts.clear()
    return rows, 0, None


def _keep(rows: Rows, stopped: str | None) -> bool:
    """Put a result into the record and the pages; False, with a message, where it may not stand there."""
    why = reason_against(rows, stopped)
    if why:
        print(f"{rows.case}: the record not replaced: {why}", file=sys.stderr)
        return False
    known = read_record(RECORD) | {rows.case: entry(rows)}
    ordered = {name: known[name] for name in CASES if name in known}
    write_record(ordered, RECORD)
    write_evidence(ordered, EVIDENCE)
    write_pages(ordered, {name: case.meaning for name, case in CASES.items()})
    return True


if __name__ == "__main__":
    sys.exit(main())
