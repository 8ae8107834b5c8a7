"""The whole step on one core beside plain FEniCSx's and LULESH's (an explicit code with a gas law), and on threads."""

from __future__ import annotations

import os
import re
import subprocess
from typing import TYPE_CHECKING, Any

from benchmarks.plain import straining_box
from benchmarks.state import in_the_middle, in_the_middle_full, one_step, shares
from benchmarks.table import at_least, at_most
from benchmarks.timing import all_threads, best_of, on_threads

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.options import Options
    from burst_fenicsx.simulation import Simulation

__all__ = ["step"]

_STEP_TARGET = 1.0 / 3.0
_FULL_TARGET = 0.2
_LULESH_TARGET = 1.0 / 6.0
_THREADS_TARGET = 1.85  # two threads over one

_CALLS, _FULL_CALLS, _REPEATS = 10, 3, 5
_THREAD_REPEATS = 4
_SIZE, _CYCLES, _SECONDS = 45, 150, 300.0  # of LULESH
_GRIND = re.compile(r"Grind time \(us/z/c\)\s*=\s*([\d.eE+-]+) \(per dom\)")
_WARM_STEPS = 20  # of the plain box, until half of it flows


def _against_plain(cell_size: float) -> dict[str, float]:
    """Seconds per cell and step of both, taken in turns on one core; and the plain boxes' cells and flowing points."""
    ours, full = in_the_middle(cell_size), in_the_middle_full(cell_size)
    cells = len(ours.mesh.cells)
    plain, plain_full = straining_box(cells, 1), straining_box(cells, 8)
    for box in (plain, plain_full):
        for _ in range(_WARM_STEPS):
            box.step()
    with on_threads(1):
        times = best_of(
            _REPEATS,
            {
                "ours": (_CALLS, lambda: one_step(ours)),
                "plain": (_CALLS, plain.step),
                "ours_full": (_FULL_CALLS, lambda: one_step(full)),
                "plain_full": (_FULL_CALLS, plain_full.step),
            },
        )
    found = {name: seconds / (plain.cells if "plain" in name else cells) for name, seconds in times.items()}
    return {**found, "cells": plain.cells, "flowing": plain.flowing, "flowing_full": plain_full.flowing}


def step(options: Options) -> dict[str, Any]:
    """The whole step: forces, hourglass control, viscosity, leakage, contact, nodes, ledger, checks."""
    times = _against_plain(options.cell_size)
    run = in_the_middle(options.cell_size)
    figures: dict[str, Any] = {
        "cells": len(run.mesh.cells),
        "share": shares(run),
        "seconds_per_cell_step": times["ours"],
        **at_most(times["ours"] / times["plain"], _STEP_TARGET, "step over plain FEniCSx's, one point each"),
        "full_quadrature": {
            "seconds_per_cell_step": times["ours_full"],
            **at_most(times["ours_full"] / times["plain_full"], _FULL_TARGET, "step over plain FEniCSx's, 2x2x2 each"),
        },
        "plain_fenicsx": {
            "cells": int(times["cells"]),
            "seconds_per_cell_step": times["plain"],
            "share_flowing": times["flowing"],
            "seconds_per_cell_step_full_quadrature": times["plain_full"],
            "share_flowing_full_quadrature": times["flowing_full"],
        },
        "threads": _on_threads(run),
        "lulesh": "absent: --lulesh PATH names its binary",
    }
    if options.lulesh is not None:
        grind = grind_time(options.lulesh)
        with on_threads(1):
            again = best_of(_REPEATS, {"ours": (_CALLS, lambda: one_step(run))})["ours"] / len(run.mesh.cells)
        grind = min(grind, grind_time(options.lulesh))
        figures["lulesh"] = {
            "seconds_per_cell_step": grind,
            **at_most(again / grind, _LULESH_TARGET, "step over LULESH's, one core each"),
        }
    return figures


def _on_threads(run: Simulation) -> dict[str, Any]:
    """The whole step on one thread, on two and on all."""
    cells = len(run.mesh.cells)

    def steps_on(number: int) -> None:
        with on_threads(number):
            for _ in range(_CALLS):
                one_step(run)

    numbers = sorted({1, min(2, all_threads()), all_threads()})
    times = best_of(_THREAD_REPEATS, {str(n): (1, lambda n=n: steps_on(n)) for n in numbers})  # type: ignore[misc]
    figures: dict[str, Any] = {"threads": all_threads()}
    for n in numbers:
        figures[f"seconds_per_cell_step_on_{n}"] = times[str(n)] / _CALLS / cells
    if numbers[-1] >= 2:
        figures |= at_least(times["1"] / times["2"], _THREADS_TARGET, "step on one thread over that on two")
    if numbers[-1] > 2:
        figures["one_over_all"] = times["1"] / times[str(numbers[-1])]
    return figures


def grind_time(binary: Path) -> float:
    """Seconds per cell and step of LULESH on one thread, 45^3 cells, by its own clock.

    Raises
    ------
    RuntimeError
        The binary does not run, or does not print what LULESH prints.
    """
    command = [str(binary.resolve()), "-s", str(_SIZE), "-i", str(_CYCLES)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=_SECONDS, check=True)
    except (OSError, subprocess.SubprocessError) as error:
        raise RuntimeError(f"{binary} does not run as LULESH: {error}") from None
    return parsed(done.stdout)


def parsed(output: str) -> float:
    """Grind time (s) of one domain from what LULESH printed."""
    found = _GRIND.search(output)
    if found is None:
        raise RuntimeError('no line "Grind time (us/z/c) = ... (per dom)": is this LULESH 2.0?')
    return 1e-6 * float(found[1])
