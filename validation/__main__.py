"""`python -m validation [NAME...] [--quick] [--json]`: run the cases, compare, print the table.

Exit code 0 when every check passed, 1 when one failed or a result was not kept, 2 for bad input, that of fragfield when
a run failed, 4 for a fault in a study. A case that cannot go on does not keep the others from being computed, and the
rows that it has already stay. What `--record` and `--readme` replace is kept case by case, and only by whole results:
see `validation.keeping`.
"""

from __future__ import annotations

import json
import sys
import traceback
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.errors import EXIT_FAULT, EXIT_INPUT, nearest
from validation.attitudes import study as attitudes
from validation.axisymmetric import study as axisymmetric
from validation.colliding_tubes import study as colliding_tubes
from validation.copper_cylinder import study as copper_cylinder
from validation.keeping import keep
from validation.m107_1944 import study as m107_1944
from validation.m107_convergence import study as m107_convergence
from validation.m107_pair import study as m107_pair
from validation.mean_mass import study as mean_mass
from validation.options import read_options
from validation.paper_3_1 import study as paper_3_1
from validation.paper_3_2 import study as paper_3_2
from validation.polar_zones import study as polar_zones
from validation.products import study as products
from validation.readme import LADDER
from validation.record import Outcome
from validation.rows import print_rows
from validation.runs import FOLDER, ROOT, Runs, StudyError
from validation.sensitivities import study as sensitivities
from validation.solid import study as solid
from validation.stack_trends import study as stack_trends
from validation.steel_tubes import study as steel_tubes

if TYPE_CHECKING:
    from collections.abc import Sequence

    from validation.options import Options
    from validation.rows import Row

CASES = {
    "products": products.study,
    "solid": solid.study,
    "axisymmetric": axisymmetric.study,
    "copper_cylinder": copper_cylinder.study,
    "steel_tubes": steel_tubes.study,
    "colliding_tubes": colliding_tubes.study,
    "stack_trends": stack_trends.study,
    "mean_mass": mean_mass.study,
    "polar_zones": polar_zones.study,
    "paper_3_1": paper_3_1.study,
    "paper_3_2": paper_3_2.study,
    "m107_1944": m107_1944.study,
    "m107_convergence": m107_convergence.study,
    "attitudes": attitudes.study,
    "m107_pair": m107_pair.study,
    "sensitivities": sensitivities.study,
}
"""The ladder, from theory to tests."""

IN_FULL = tuple(name for name in CASES if not name.startswith(("paper", "sensitivities")))
"""Cases whose rows stand in full in validation/README.md; the others write tables of their own."""


def main(arguments: Sequence[str] | None = None) -> int:
    """Run what the command line asks for and return the exit code."""
    options = read_options(arguments, CASES, __doc__)
    unknown = [name for name in options.names if name not in CASES]
    if unknown:
        hint = nearest(unknown[0], CASES)
        print(f"validation: no case is named {unknown[0]!r}{hint}; there are {', '.join(CASES)}", file=sys.stderr)
        return EXIT_INPUT
    folder = options.out.resolve() if options.out else FOLDER
    runs = Runs(folder, resume=options.resume, threads=options.threads, ranks=options.ranks)
    outcomes: dict[str, Outcome] = {}
    codes, left = [], False
    for name in options.names or CASES:
        outcomes[name], code = computed(name, options, runs)
        codes += [code] if code else []
        if options.record or options.readme:
            words = keep({name: outcomes[name]}, options, tuple(CASES), IN_FULL)
            print(words, end="\n" if words else "", file=sys.stderr)
            left |= bool(words)
    rows = [row for outcome in outcomes.values() for row in outcome.rows]
    if options.json:
        print(json.dumps([row.as_dict() for row in rows], indent=1))
    else:
        print_rows(rows)
    return codes[0] if codes else int(left or any(row.passed is False for row in rows))


def computed(name: str, options: Options, runs: Runs) -> tuple[Outcome, int]:
    """The outcome of a case and the exit code that it asks for.

    A study adds its rows to a list as it gets them. If it cannot go on, or has a fault, those that it has are kept, and
    a message says why and how far it came.
    """
    rows: list[Row] = []
    try:
        CASES[name](options, runs, rows)
    except StudyError as error:
        print(f"validation: {name}: {error}; {_kept(rows)}", file=sys.stderr)
        return Outcome(tuple(rows), str(error)), error.code
    except Exception as error:  # noqa: BLE001 - of one study: the others, and what is recorded, must not suffer from it
        traceback.print_exc()
        fault = f"{type(error).__name__}: {error}"
        print(f"validation: {name}: a fault in {_step(error)}: {fault}; {_kept(rows)}", file=sys.stderr)
        return Outcome(tuple(rows), fault), EXIT_FAULT
    return Outcome(tuple(rows)), 0


def _step(error: Exception) -> str:
    """The innermost place of the ladder's own code that a fault came through, as `file:line, function`."""
    frames = traceback.extract_tb(error.__traceback__)
    place = [frame for frame in frames if Path(frame.filename).is_relative_to(LADDER.parent)][-1]
    return f"{Path(place.filename).relative_to(ROOT)}:{place.lineno}, {place.name}"


def _kept(rows: Sequence[Row]) -> str:
    """How many rows there are already, and which was the last."""
    if not rows:
        return "no row was computed before it"
    return f"{len(rows)} rows were computed before it, the last of them {rows[-1].quantity!r}"


if __name__ == "__main__":
    sys.exit(main())
