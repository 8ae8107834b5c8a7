"""`fragfield sweep`: a case run for every combination of some of its values, and one table of the results."""

from __future__ import annotations

from fragfield.studies.sweep.plan import SweepPlan, plan_sweep
from fragfield.studies.sweep.results import print_sweep
from fragfield.studies.sweep.work import SweepOptions, run_sweep

__all__ = ["SweepOptions", "SweepPlan", "plan_sweep", "print_sweep", "run_sweep"]
