"""The first commands on a machine: with empty caches, where kernels are compiled, and again with full ones."""

from __future__ import annotations

import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.table import at_most

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from benchmarks.options import Options

__all__ = ["compilation"]

_ROOT = Path(__file__).resolve().parent.parent
_COMPILE_TARGET = 20.0  # s, from the interpreter's start to the first step and beyond
_COMMANDS = {
    "single_round_to_the_report": ("run", "cases/m107_tnt.toml", "--set", "burst.cell_size=6 mm"),
    "pair_in_three_dimensions": (
        "burst", "cases/m107_pair.toml", "--set", "burst.cell_size=12 mm", "--set", "burst.end_time=30 us",
    ),
}  # fmt: skip


def compilation(options: Options) -> dict[str, Any]:
    """Wall and processor seconds of two commands, the second one after the first in the same caches, as a user's."""
    del options
    figures: dict[str, Any] = {}
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as folder:
        empty = {"NUMBA_CACHE_DIR": f"{folder}/numba", "XDG_CACHE_HOME": folder}
        for name, command in _COMMANDS.items():
            first, again = (_timed(command, f"{folder}/run", empty) for _ in range(2))
            compiling = first["seconds"] - again["seconds"]
            figures[name] = {
                "seconds_first": first["seconds"],
                "processor_seconds_first": first["processor_seconds"],
                "seconds_again": again["seconds"],
                "processor_seconds_again": again["processor_seconds"],
                "seconds_compiling": compiling,
                **at_most(compiling / _COMPILE_TARGET, 1.0, "compiling over 20 s"),
            }
    return figures


def _timed(command: Sequence[str], out: str, environment: Mapping[str, str]) -> dict[str, float]:
    """Wall and processor seconds of a command of fragfield."""
    before, began = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter()
    subprocess.run(
        [sys.executable, "-m", "fragfield", *command, "--out", out, "--overwrite", "--quiet"],
        cwd=_ROOT, env={**os.environ, **environment}, check=True,
    )  # fmt: skip
    after, spent = resource.getrusage(resource.RUSAGE_CHILDREN), time.perf_counter() - began
    used = after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime
    return {"seconds": spent, "processor_seconds": used}
