"""Hazard distances of the fragments of cased charges, from the burst to the ground, for explosives safety.

From Python::

    import fragfield

    case = fragfield.Case.from_toml("first.toml", set=["burst.cell_size=8 mm"])
    run = fragfield.run(case, out="runs/first")
    print(run.hazard.upper)

`fragfield.open` reads a run directory that is there. Every name is loaded when it is first used: neither dolfinx nor
MPI, matplotlib or pandas come with the import. The guide's page "Python" has examples.

Errors: `InputError` for what the caller can mend, `NumericalStop` for a computation that was ended because it left its
bounds, `NotDeterminedError` for a hazard distance that was asked for and is not determined. Their messages are those of
the command line, where they are the exit codes 2, 3 and 3.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import fragfield_base  # noqa: F401 - it settles how threads wait, before a caller imports dolfinx
from fragfield.version import __version__

if TYPE_CHECKING:
    from fragfield.errors import NotDeterminedError
    from fragfield.interface.case import Case
    from fragfield.interface.checking import CheckResult, check
    from fragfield.interface.hazard import HazardDistance
    from fragfield.interface.results import Run, open  # noqa: A004 - as h5py.File has its `open`
    from fragfield.interface.running import run
    from fragfield.interface.studies import Comparison, Sweep, Uncertainty, compare_runs, run_sweep, run_uncertainty
    from fragfield.interface.tables import Table
    from fragfield.terminal.progress import Progress
    from fragfield_base.errors import InputError, NumericalStop

__all__ = [
    "Case",
    "CheckResult",
    "Comparison",
    "HazardDistance",
    "InputError",
    "NotDeterminedError",
    "NumericalStop",
    "Progress",
    "Run",
    "Sweep",
    "Table",
    "Uncertainty",
    "__version__",
    "check",
    "compare_runs",
    "open",
    "run",
    "run_sweep",
    "run_uncertainty",
]

_HOMES = {
    "Case": "fragfield.interface.case",
    "CheckResult": "fragfield.interface.checking",
    "HazardDistance": "fragfield.interface.hazard",
    "InputError": "fragfield_base.errors",
    "NotDeterminedError": "fragfield.errors",
    "NumericalStop": "fragfield_base.errors",
    "Progress": "fragfield.terminal.progress",
    "Run": "fragfield.interface.results",
    "Table": "fragfield.interface.tables",
    "check": "fragfield.interface.checking",
    "open": "fragfield.interface.results",
    "run": "fragfield.interface.running",
    **dict.fromkeys(
        ("Comparison", "Sweep", "Uncertainty", "compare_runs", "run_sweep", "run_uncertainty"),
        "fragfield.interface.studies",
    ),
}


def __getattr__(name: str) -> Any:  # noqa: ANN401 - what is asked for
    if name not in _HOMES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib import import_module

    return getattr(import_module(_HOMES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
