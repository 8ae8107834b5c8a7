"""One rank against two: the stepping of the pair of M107, one thread a rank.

Two independent processes side by side are measured too: what they lose to each other is the machine's, not the ranks'.
`mpirun -n N python -m benchmarks.ranks` steps the pair on N ranks, and rank 0 prints the seconds as JSON.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from benchmarks.table import at_least

if TYPE_CHECKING:
    from benchmarks.options import Options

__all__ = ["ranks"]

_ROOT = Path(__file__).resolve().parent.parent
_PAIR, _SIZE, _END = _ROOT / "cases/m107_pair.toml", "6 mm", 120e-6
_TARGET = 1.8
_REPEATS = 2

_BOUND = ("--bind-to", "core")
_FREE = ("--bind-to", "none")  # side by side: Open MPI would bind both to the first core


def ranks(options: Options) -> dict[str, Any]:
    """Seconds of stepping on one rank, on two, and on one beside an independent one."""
    found: dict[str, list[dict[str, Any]]] = {"1": [], "2": [], "1 beside 1": []}
    for _ in range(1 if options.quick else _REPEATS):  # in turns: the machine's speed drifts
        found["1"].append(_finished(_started(1, _BOUND)))
        found["2"].append(_finished(_started(2, _BOUND)))
        both = [_started(1, _FREE) for _ in range(2)]
        found["1 beside 1"].append(max((_finished(run) for run in both), key=_seconds))
    one, two, beside = best = [min(runs, key=_seconds) for runs in found.values()]
    faster, at_most = one["seconds"] / two["seconds"], 2.0 * one["seconds"] / beside["seconds"]
    return {
        "cells": one["cells"],
        **at_least(faster, _TARGET, "one rank over two, one thread each"),
        "two_independent_processes_over_one": at_most,
        "two_ranks_over_two_independent_processes": faster / at_most,
        "measured": [
            {"ranks": name, "seconds": run["seconds"], "one_over_it": one["seconds"] / run["seconds"]}
            for name, run in zip(found, best, strict=True)
        ],
    }


def _seconds(run: dict[str, Any]) -> float:
    return float(run["seconds"])


def _started(number: int, binding: tuple[str, ...]) -> subprocess.Popen[str]:
    command = ["mpirun", "-n", str(number), *binding, sys.executable, "-m", "benchmarks.ranks"]
    # MPI, once it runs here, adds variables behind Python's back with which no further mpirun starts.
    return subprocess.Popen(command, cwd=_ROOT, env=dict(os.environ), stdout=subprocess.PIPE, text=True)


def _finished(run: subprocess.Popen[str]) -> dict[str, Any]:
    output, _ = run.communicate()  # colour codes may stand before and behind the figures
    if run.returncode:
        raise subprocess.CalledProcessError(run.returncode, run.args)
    figures: dict[str, Any] = json.loads(output[output.index("{") : output.rindex("}") + 1])
    return figures


def _main() -> None:
    """Step the whole pair in three dimensions on all ranks."""
    import numba
    from mpi4py import MPI

    from burst_fenicsx.simulation import Simulation
    from fragfield.case import load_case
    from fragfield.case.conversion.rounds import burst_rounds
    from fragfield.case.problem import burst_settings

    numba.set_num_threads(1)
    case, comm = load_case(_PAIR, {"burst.cell_size": _SIZE}), MPI.COMM_WORLD
    settings = replace(burst_settings(case, geometry="3d"), end_time=_END, symmetry="off")
    with tempfile.TemporaryDirectory() as folder:
        run = Simulation(burst_rounds(case), settings, Path(folder), comm, {})
        comm.Barrier()
        began = time.perf_counter()
        while run.solver.time < _END * (1.0 - 1e-12):
            run.solver.step(_END)
        comm.Barrier()
        seconds = time.perf_counter() - began
    cells = comm.allreduce(run.fields.mesh.cells)
    if comm.rank == 0:
        print(json.dumps({"cells": int(cells), "seconds": seconds}))


if __name__ == "__main__":
    _main()
