"""Hazard distances of the fragments of cased charges, from the burst to the ground, for explosives safety.

From Python::

    import fragfield

    case = fragfield.Case.from_toml("first.toml", set=["burst.cell_size=8 mm"])
    run = fragfield.run(case, out="runs/first")
    print(run.hazard)

`fragfield.open` reads a run directory that is there. Every name is loaded when it is first used: neither dolfinx nor
MPI, matplotlib or pandas come with the import. The guide's page "Python" has examples.
`fragfield.import_table` reads tables of tests as people have them.

Errors: `InputError` for what the caller can mend, `QuestionError` among them where a table of a test has two
meanings, `NumericalStop` for a computation that was ended because it left its bounds, `NotDeterminedError` for a
distance that was asked for and is not determined. Their messages are those of the command line, where they are the exit
codes 2, 2, 3 and 3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from fragfield_base.lazy_names import lazy_names
from fragfield_base.version import __version__

if TYPE_CHECKING:
    from fragfield.errors import NotDeterminedError
    from fragfield.importing.sheet import QuestionError
    from fragfield.importing.table import ImportedTable, import_table
    from fragfield.interface.case import Case
    from fragfield.interface.checking import CheckResult, Converted, check, convert
    from fragfield.interface.results import HazardDistance, Run, open  # noqa: A004 - as h5py.File has its `open`
    from fragfield.interface.running import run
    from fragfield.studies.limit import Limit, run_limit
    from fragfield.studies.ratios import compare_runs
    from fragfield.studies.sweep import Sweep, run_sweep
    from fragfield.studies.uncertainty.study import Uncertainty, run_uncertainty
    from fragfield.terminal.progress import Progress
    from fragfield_base.errors import InputError, NumericalStop

__all__ = [
    "Case",
    "CheckResult",
    "Converted",
    "HazardDistance",
    "ImportedTable",
    "InputError",
    "Limit",
    "NotDeterminedError",
    "NumericalStop",
    "Progress",
    "QuestionError",
    "Run",
    "Sweep",
    "Uncertainty",
    "__version__",
    "check",
    "compare_runs",
    "convert",
    "import_table",
    "open",
    "run",
    "run_limit",
    "run_sweep",
    "run_uncertainty",
]

__getattr__, __dir__ = lazy_names(
    __name__,
    {
        "fragfield.errors": "NotDeterminedError",
        "fragfield.importing.sheet": "QuestionError",
        "fragfield.importing.table": "ImportedTable import_table",
        "fragfield.interface.case": "Case",
        "fragfield.interface.checking": "CheckResult Converted check convert",
        "fragfield.interface.results": "HazardDistance Run open",
        "fragfield.interface.running": "run",
        "fragfield.studies.limit": "Limit run_limit",
        "fragfield.studies.ratios": "compare_runs",
        "fragfield.studies.sweep": "Sweep run_sweep",
        "fragfield.studies.uncertainty.study": "Uncertainty run_uncertainty",
        "fragfield.terminal.progress": "Progress",
        "fragfield_base.errors": "InputError NumericalStop",
    },
)
