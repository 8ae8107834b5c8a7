"""The burst's step on the 155 mm round in the middle of its expansion: casing plastic, products burnt."""

from __future__ import annotations

import logging
import tempfile
import time
from pathlib import Path
from typing import Any

import numba
from mpi4py import MPI

from burst_fenicsx.geometry import load_profile
from burst_fenicsx.materials.library import load_casing, load_explosive
from burst_fenicsx.problem import BurstSettings, IgnitionPoint, Round
from burst_fenicsx.simulation import Simulation

__all__ = ["step", "threads"]

_CELL_SIZE = 5e-3
_MIDDLE = 60e-6
_STEPS = 30
_REPEATS = 3

_state: list[Simulation] = []


def _in_the_middle() -> Simulation:
    """The run at mid-expansion, made once."""
    if not _state:
        logging.disable(logging.WARNING)
        profile = load_profile("grenade_155")
        item = Round(
            name="grenade",
            explosive=load_explosive("tnt"),
            casing=load_casing("steel_paper"),
            profile=profile,
            ignition=(IgnitionPoint(profile.charge_front),),
        )
        folder = Path(tempfile.mkdtemp(prefix="fragfield-bench-"))
        run = Simulation([item], BurstSettings(cell_size=_CELL_SIZE), folder, MPI.COMM_SELF, {})
        while run.solver.time < _MIDDLE:
            run.solver.step(_MIDDLE)
        _state.append(run)
    return _state[0]


def _seconds_per_cell_step(number: int) -> float:
    """Best of some repeats of whole steps on `number` threads (s)."""
    run = _in_the_middle()
    before = numba.get_num_threads()
    numba.set_num_threads(number)
    try:
        best = float("inf")
        for _ in range(_REPEATS):
            began = time.perf_counter()
            for _ in range(_STEPS):
                run.solver.step()
            best = min(best, time.perf_counter() - began)
    finally:
        numba.set_num_threads(before)
    return best / _STEPS / len(run.mesh.cells)


def step() -> dict[str, Any]:
    """Whole step on one core: forces, nodes, leakage, ledger, checks."""
    return {"cells": len(_in_the_middle().mesh.cells), "seconds_per_cell_step": _seconds_per_cell_step(1)}


def threads() -> dict[str, Any]:
    """The same on one thread and on all; the ratio's aim is for two."""
    number = numba.config.NUMBA_NUM_THREADS
    one, all_of_them = _seconds_per_cell_step(1), _seconds_per_cell_step(number)
    figures = {"threads": number, "seconds_per_cell_step": all_of_them, "ratio": one / all_of_them}
    return {**figures, "target": 1.85} if number == 2 else figures
