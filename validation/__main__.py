"""`python -m validation [NAME...] [--quick] [--json]`: run the cases, compare, print the table.

Exit code 0 when every check passed, 1 when one failed, 2 for bad input, that of fragfield when a run failed; a case
that cannot go on does not keep the others from being computed.
"""

from __future__ import annotations

import json
import sys
from typing import TYPE_CHECKING

from fragfield.errors import EXIT_INPUT, nearest
from validation.axisymmetric import study as axisymmetric
from validation.colliding_tubes import study as colliding_tubes
from validation.copper_cylinder import study as copper_cylinder
from validation.m107_1944 import study as m107_1944
from validation.m107_convergence import study as m107_convergence
from validation.m107_pair import study as m107_pair
from validation.mean_mass import study as mean_mass
from validation.options import read_options
from validation.paper_3_1 import study as paper_3_1
from validation.paper_3_2 import study as paper_3_2
from validation.plane_section import study as plane_section
from validation.products import study as products
from validation.readme import LADDER, README, insert_tables
from validation.record import Outcome, entry, overview, read_record, write_record
from validation.rows import print_rows, rows_table
from validation.runs import FOLDER, Runs, StudyError
from validation.sensitivities import study as sensitivities
from validation.solid import study as solid
from validation.stack_trends import study as stack_trends
from validation.steel_tubes import study as steel_tubes

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from validation.options import Options

CASES = {
    "products": products.study,
    "solid": solid.study,
    "axisymmetric": axisymmetric.study,
    "copper_cylinder": copper_cylinder.study,
    "steel_tubes": steel_tubes.study,
    "colliding_tubes": colliding_tubes.study,
    "stack_trends": stack_trends.study,
    "plane_section": plane_section.study,
    "mean_mass": mean_mass.study,
    "paper_3_1": paper_3_1.study,
    "paper_3_2": paper_3_2.study,
    "m107_1944": m107_1944.study,
    "m107_convergence": m107_convergence.study,
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
    codes = []
    for name in options.names or CASES:
        try:
            outcomes[name] = Outcome(tuple(CASES[name](options, runs)))
        except StudyError as error:
            print(f"validation: {error}", file=sys.stderr)
            outcomes[name] = Outcome((), str(error))
            codes.append(error.code)
    rows = [row for outcome in outcomes.values() for row in outcome.rows]
    if options.json:
        print(json.dumps([row.as_dict() for row in rows], indent=1))
    else:
        print_rows(rows)
    if options.record or options.readme:
        keep(outcomes, options)
    return codes[0] if codes else int(any(row.passed is False for row in rows))


def keep(outcomes: Mapping[str, Outcome], options: Options) -> None:
    """Write what was found into the record and into the tables of the READMEs; a part of a case is no case."""
    if options.sensitivities or options.scaling:
        return
    known = read_record() | {name: entry(outcome, quick=options.quick) for name, outcome in outcomes.items()}
    ordered = {name: known[name] for name in CASES if name in known}
    if options.record:
        write_record(ordered)
    if options.readme:
        insert_tables({"validation": overview(ordered, tuple(CASES))}, README)
        full = {name: rows_table(outcome.rows) for name, outcome in outcomes.items() if name in IN_FULL}
        insert_tables(full, LADDER)


if __name__ == "__main__":
    sys.exit(main())
