"""The paper's case 3.1 as a user runs it: 3 mm cells to 120 us, mesh and output included, on all cores."""

from __future__ import annotations

import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.goal import at_most
from benchmarks.state import CASE
from validation.runs import ROOT, Runs, summary_of

if TYPE_CHECKING:
    from benchmarks.options import Options

__all__ = ["case"]

_TARGET = 60.0
_PAPER = 1800.0  # Wang et al., section 3.1; the same table gives 3 to 5 hours for AUTODYN


def case(options: Options) -> dict[str, Any]:
    """Wall time of `fragfield burst`, from its call to its end."""
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as folder:
        runs = Runs(Path(folder))
        began = time.perf_counter()
        out = runs.run("case", str(CASE.relative_to(ROOT)), f"{1e3 * options.fine_cell_size:g} mm", stage="burst")
        seconds = time.perf_counter() - began
        burst = summary_of(out)["burst"]
    return {
        "cells": burst["cells"],
        "steps": burst["steps"],
        "threads": burst["threads"],
        "seconds": seconds,
        "seconds_in_the_paper": _PAPER,
        "target_seconds": _TARGET,
        "mean_initial_speed": burst["mean_initial_speed"],
        "energy_error": burst["energy_error"],
        **at_most(seconds / _TARGET, 1.0, "wall time over 60 s"),
    }
