"""Whole bursts beside the plain step: what levels, contact, searches, sums and files take besides the cells."""

from __future__ import annotations

import json
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.state import CASE, in_the_middle, one_step
from benchmarks.table import at_most
from benchmarks.timing import all_threads, best_of

if TYPE_CHECKING:
    from benchmarks.options import Options

__all__ = ["beside", "whole"]

_PAIR = CASE.with_name("m107_pair.toml")
_TARGET = 1.5  # a cell and step of the whole run over one of the plain step
_SECONDS = {"single": 0.12e-6, "pair": 0.14e-6}  # targets of a cell and step of the whole run on two cores (s)
_CALLS, _REPEATS = 10, 4


def whole(options: Options) -> dict[str, Any]:
    """Cases 3.1 and 3.2 in three dimensions with cells of the fine size, on all threads, files included."""
    run = in_the_middle(options.cell_size)
    plain = best_of(_REPEATS, {"step": (_CALLS, lambda: one_step(run))})["step"] / len(run.mesh.cells)
    figures: dict[str, Any] = {"threads": all_threads(), "plain_step_seconds_per_cell_step": plain}
    for name, case in (("single", CASE), ("pair", _PAIR)):
        figures[name] = beside(_burst(case, options.fine_cell_size), plain, name)
    return figures


def _burst(case: Path, cell_size: float) -> dict[str, Any]:
    """The burst's part of summary.json of a run in a process of its own."""
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as folder:
        command = [
            sys.executable, "-m", "fragfield", "burst", str(case), "--out", folder, "--overwrite", "--quiet",
            "--set", f"burst.cell_size={1e3 * cell_size:g} mm", "--set", "burst.geometry=3d",
        ]  # fmt: skip
        subprocess.run(command, cwd=CASE.parent.parent, check=True)
        found: dict[str, Any] = json.loads((Path(folder) / "summary.json").read_text(encoding="utf-8"))["burst"]
        return found


def beside(burst: dict[str, Any], plain: float, name: str) -> dict[str, Any]:
    """Figures of a burst's summary beside the plain step's seconds for a cell and step."""
    spent = burst["seconds_per_cell_step"]
    return {
        "cell_size": burst["cell_size"],
        "cells": burst["cells"],
        "cell_steps": burst["cell_steps"],
        "wall_seconds": burst["wall_seconds"],
        "seconds_per_cell_step": spent,
        **at_most(spent / plain, _TARGET, f"{name}: whole run over the plain step, a cell and step"),
        "alone": at_most(spent / _SECONDS[name], 1.0, f"a cell and step over {1e6 * _SECONDS[name]:g} us"),
    }
