"""`fragfield compare`: one run divided by another, a pair by its single round, a fill by another fill."""

from __future__ import annotations

from fragfield.studies.compare.comparison import compare_runs
from fragfield.studies.compare.files import write_comparison
from fragfield.studies.compare.show import print_comparison

__all__ = ["compare_runs", "print_comparison", "write_comparison"]
