"""How cost grows with the number of cells: steps over a fixed time, and the search for surfaces that meet."""

from __future__ import annotations

import time
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.goal import near
from benchmarks.state import expanding, one_step
from benchmarks.timing import all_threads, best_of

if TYPE_CHECKING:
    from collections.abc import Sequence

    from benchmarks.options import Options
    from burst_fenicsx.simulation import Simulation

__all__ = ["growth", "growth_of"]

_SIZES = (6.3e-3, 4.4e-3, 3.1e-3, 1.94e-3)  # m: 40 thousand to 1.4 million cells
_QUICK_SIZES = _SIZES[:3]
_RUNS, _STEPS = 2, 25
_SEARCHES = 3
_EXPECTED = 4.0 / 3.0  # cells times steps, which grow with one over the cells' size
_TOLERANCE, _SEARCH_TOLERANCE = 0.05, 0.10


def growth(options: Options) -> dict[str, Any]:
    """Exponents of the cost over the number of cells, and of a search over the number of surface nodes."""
    return growth_of(_QUICK_SIZES if options.quick else _SIZES)


def growth_of(sizes: Sequence[float]) -> dict[str, Any]:
    """The same for rounds with cells of these sizes (m)."""
    rows = [_one_size(size) for size in sizes]
    cells, seconds, size, surface, search = (
        np.array([row[key] for row in rows])
        for key in ("cells", "seconds_per_step", "cell_size", "surface_nodes", "seconds_per_search")
    )
    exponent = _exponent(cells, seconds / size)
    searching = _exponent(surface, search)
    return {
        "threads": all_threads(),
        "sizes": rows,
        "exponent": exponent,
        "expected_exponent": _EXPECTED,
        **near(exponent / _EXPECTED, _TOLERANCE, "exponent of the cost of a given time over 4/3"),
        "search": {
            "exponent": searching,
            **near(searching, _SEARCH_TOLERANCE, "exponent of a search over surface nodes, over 1"),
        },
    }


def _exponent(number: np.ndarray, cost: np.ndarray) -> float:
    """Slope of the cost over the number, both by their logarithms."""
    return float(np.polyfit(np.log(number), np.log(cost), 1)[0])


def _one_size(cell_size: float) -> dict[str, Any]:
    """Seconds per step and per search of an expanding round on all threads."""
    run = expanding(cell_size)
    best = float("inf")
    for _ in range(_RUNS):
        began = time.perf_counter()
        for _ in range(_STEPS):
            one_step(run)
        best = min(best, (time.perf_counter() - began) / _STEPS)
    return {
        "cell_size": cell_size,
        "cells": len(run.mesh.cells),
        "seconds_per_step": best,
        "seconds_per_cell_step": best / len(run.mesh.cells),
        "time_step": run.solver.time_step,
        **_search(run),
    }


def _search(run: Simulation) -> dict[str, Any]:
    """Nodes on surfaces, and seconds of one search among them where they now are."""
    collisions = run.contact.collisions
    assert collisions is not None  # the case lets surfaces meet
    return {
        "surface_nodes": len(collisions.surfaces.node),
        "seconds_per_search": best_of(_SEARCHES, {"search": (1, collisions.search)})["search"],
    }
