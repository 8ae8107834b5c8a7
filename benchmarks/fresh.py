"""A run in a process of its own: `python -m benchmarks.fresh CELL_SIZE END_TIME` prints times and memory as JSON."""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Mapping

__all__ = ["figures_of", "fresh_run", "peak_bytes"]

_ROOT = Path(__file__).resolve().parent.parent


def fresh_run(cell_size: float, end_time: float, environment: Mapping[str, str] | None = None) -> dict[str, Any]:
    """Compute the case to `end_time` (s) in a new interpreter, with output, on all threads.

    Parameters
    ----------
    cell_size, end_time : m and s.
    environment : variables to add to this process's.

    Returns
    -------
    dict
        `cells`, `seconds_to_imports`, `seconds_to_set_up`, `seconds_to_first_step`, each since the interpreter
        was called, and `peak_bytes`, the most memory that was resident.
    """
    began = time.monotonic()  # one clock for all processes
    figures = figures_of("benchmarks.fresh", cell_size, end_time, environment=environment)
    return {key: value - began if key.startswith("seconds_to") else value for key, value in figures.items()}


def figures_of(module: str, *arguments: float, environment: Mapping[str, str] | None = None) -> dict[str, Any]:
    """What a module prints as JSON in its last line when a new interpreter runs it with these arguments.

    Parameters
    ----------
    module, arguments : of `python -m`.
    environment : variables to add to this process's.
    """
    command = [sys.executable, "-m", module, *map(repr, arguments)]
    done = subprocess.run(
        command, cwd=_ROOT, env={**os.environ, **(environment or {})}, stdout=subprocess.PIPE, text=True, check=True
    )
    figures: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return figures


def peak_bytes() -> int:
    """Most resident memory of this process so far; what `getrusage` says may be that of the process before it."""
    try:
        status = Path("/proc/self/status").read_text(encoding="ascii")
        return 1024 * int(status.partition("VmHWM:")[2].split()[0])
    except (OSError, IndexError):
        return 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss


def _main(cell_size: float, end_time: float) -> None:
    from benchmarks.state import new_run

    figures: dict[str, Any] = {"seconds_to_imports": time.monotonic()}
    run = new_run(cell_size, end_time=end_time, subcycling=True)
    figures["seconds_to_set_up"] = time.monotonic()
    run.solver.step()
    figures["seconds_to_first_step"] = time.monotonic()
    run.run()
    run.finish()
    print(json.dumps({"cells": len(run.mesh.cells), **figures, "peak_bytes": peak_bytes()}))


if __name__ == "__main__":
    _main(float(sys.argv[1]), float(sys.argv[2]))
