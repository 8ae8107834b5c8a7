"""How fast a casing is broken up into many fragments: law, placing and velocity, without any flight."""

from __future__ import annotations

import time
from dataclasses import replace
from typing import TYPE_CHECKING, Any

from benchmarks.goal import at_most
from transition import BreakUp, BreakUpSettings

if TYPE_CHECKING:
    from pathlib import Path

    from benchmarks.options import Options

__all__ = ["break_up", "break_up_of"]

_FRAGMENTS = 50_000
_END_TIME = 2e-6  # s
_SECONDS = 2.0
_RUNS = 3


def break_up(options: Options) -> dict[str, Any]:
    """Seconds for 50,000 fragments of the paper's round just after initiation: neither cells nor law know its age."""
    from benchmarks.state import new_run

    run = new_run(options.cell_size, end_time=_END_TIME, subcycling=True)
    run.run()
    run.finish()
    return break_up_of(run.out_dir / "burst_snapshot.h5")


def break_up_of(snapshot: Path, fragments: int = _FRAGMENTS) -> dict[str, Any]:
    """The same for a snapshot, and the number of fragments to be had of it."""
    began = time.perf_counter()
    settings = BreakUpSettings()
    prepared = BreakUp(snapshot, settings)
    reading = time.perf_counter() - began
    mass = sum(law.mass for law in prepared.laws)
    prepared = BreakUp(prepared.snapshot, replace(settings, mean_mass=mass / fragments))
    made = len(prepared.fragments(0))  # compiles, where it is the first
    best, whole = float("inf"), float("inf")
    for number in range(1, 1 + _RUNS):
        began = time.perf_counter()
        prepared.fragments(0, number)
        best = min(best, time.perf_counter() - began)
        began = time.perf_counter()
        prepared.realisation(0, number)
        whole = min(whole, time.perf_counter() - began)
    return {
        "fragments": made,
        "casing_cells": len(prepared.snapshot.casing),
        "seconds_reading": reading,
        "seconds_with_ledgers_and_directions": whole,
        "seconds_drawing_placing_and_velocity": best,
        **at_most(best / _SECONDS * _FRAGMENTS / made, 1.0, "time of 50,000 fragments over 2 s"),
    }
