"""`fragfield compare`: one run divided by another, a pair by its single round, a fill by another fill."""

from __future__ import annotations

from fragfield.compare.comparison import compare_runs
from fragfield.compare.files import write_comparison
from fragfield.compare.show import print_comparison

__all__ = ["compare_runs", "print_comparison", "write_comparison"]
