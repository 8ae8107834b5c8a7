"""Start-up time and memory of a fresh process, and the time that compiling takes where nothing is cached."""

from __future__ import annotations

import tempfile
from functools import cache
from typing import TYPE_CHECKING, Any

from benchmarks.fresh import fresh_run
from benchmarks.goal import at_most

if TYPE_CHECKING:
    from benchmarks.options import Options

__all__ = ["compilation", "memory", "start_up"]

_END = 2e-6  # s: a few steps
_COARSER = 5.0 / 3.0  # the other size, over the fine one
_COMPILED_SIZE = 12e-3  # m: what is computed is to take no time
_MEMORY_TARGET = 1.2e9
_START_TARGET = 2.5
_REPEATS = 2


@cache
def _repeated(cell_size: float) -> dict[str, Any]:
    """The quicker of two fresh runs, the first of which also brings files into memory."""
    runs = [fresh_run(cell_size, _END) for _ in range(_REPEATS)]
    return min(runs, key=lambda run: float(run["seconds_to_first_step"]))


def memory(options: Options) -> dict[str, Any]:
    """Peak resident memory of a few steps with output; the cost of a cell from two sizes."""
    fine, coarse = _repeated(options.fine_cell_size), fresh_run(_COARSER * options.fine_cell_size, _END)
    more = fine["peak_bytes"] - coarse["peak_bytes"]
    return {
        "cells": fine["cells"],
        "peak_bytes": fine["peak_bytes"],
        "target_bytes": int(_MEMORY_TARGET),
        "bytes_per_cell": more / (fine["cells"] - coarse["cells"]),
        **at_most(fine["peak_bytes"] / _MEMORY_TARGET, 1.0, "peak memory over 1.2 GB"),
    }


def start_up(options: Options) -> dict[str, Any]:
    """From the call of the interpreter to the end of the first step, kernels being compiled and cached."""
    run = _repeated(options.fine_cell_size)
    return {
        "cells": run["cells"],
        "seconds_to_imports": run["seconds_to_imports"],
        "seconds_to_set_up": run["seconds_to_set_up"],
        "seconds_to_first_step": run["seconds_to_first_step"],
        "target_seconds": _START_TARGET,
        **at_most(run["seconds_to_first_step"] / _START_TARGET, 1.0, f"start-up over {_START_TARGET:g} s"),
    }


def compilation(options: Options) -> dict[str, Any]:
    """The first run on a machine: all kernels and forms are compiled into empty caches."""
    del options
    warm = min(fresh_run(_COMPILED_SIZE, _END)["seconds_to_first_step"] for _ in range(2))
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as folder:
        empty = {"NUMBA_CACHE_DIR": f"{folder}/numba", "XDG_CACHE_HOME": folder}
        cold = fresh_run(_COMPILED_SIZE, _END, empty)["seconds_to_first_step"]
    return {"seconds_compiling": cold - warm, "seconds_to_first_step": cold, "seconds_to_first_step_cached": warm}
