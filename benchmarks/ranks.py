"""One rank against two, and by simulation up to 1,024: balance, halos, memory and efficiency of a pallet.

The pair of M107 is stepped on ranks of one thread each, and on one rank beside an independent one: what
two processes lose to each other then is the machine's, the rest is ours. The estimate is a sum of four parts for each
rank: its cells at the measured rate, with the balance that the recorded levels have in the partition; the exchange of
shared nodes, counted in the partition; the exchange of contact; and searches. Only the network is assumed, and that a
round of a pallet has the levels of one of the pair.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.goal import at_least
from benchmarks.rank_estimate import (
    BAND_WIDTH,
    LATENCY,
    History,
    Measured,
    balance,
    cost_of,
    estimate,
    mesh_of,
    shared_nodes,
    slabs,
)
from burst_fenicsx.meshing.partition import partition
from fragfield.case import load_case
from fragfield.case.conversion.stages import burst_rounds

if TYPE_CHECKING:
    from benchmarks.options import Options

__all__ = ["ranks"]

_ROOT = Path(__file__).resolve().parent.parent
_PAIR = "cases/m107_pair.toml"
_SIZE, _END = 6e-3, 120e-6  # m, s: what is measured
_TARGET = 1.8
_REPEATS = 2
_MANY = tuple(2**k for k in range(1, 11))
_ROUNDS = 32  # of a pallet of 4 x 4 in two layers
_FINE = 3e-3  # m, cells of the whole pallet

_BOUND = ("--bind-to", "core")
_FREE = ("--bind-to", "none")  # side by side: OpenMPI would bind both to the first core


def ranks(options: Options) -> dict[str, Any]:
    """Time on one rank, on two and on one beside another, and the estimates for many."""
    found: dict[str, list[dict[str, Any]]] = {"one": [], "two": [], "beside": []}
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as folder:
        kept = Path(folder) / "levels.npz"
        for _ in range(1 if options.quick else _REPEATS):  # in turns: the machine's speed drifts
            found["one"].append(_finished(_started(1, kept, _BOUND)))
            found["two"].append(_finished(_started(2, kept, _BOUND)))
            both = [_started(1, kept.with_name(f"{k}.npz"), _FREE) for k in range(2)]
            found["beside"].append(max((_finished(run) for run in both), key=lambda run: float(run["seconds"])))
        history = _history(kept)
    one, two, beside = (min(runs, key=lambda run: float(run["seconds"])) for runs in found.values())
    measured = measured_by(one, two)
    faster, at_most = one["seconds"] / two["seconds"], 2.0 * one["seconds"] / beside["seconds"]
    return {
        "cells": one["cells"],
        **at_least(faster, _TARGET, "one rank over two, one thread each"),
        "two_independent_processes_over_one": at_most,
        "two_ranks_over_two_independent_processes": faster / at_most,
        "processor_seconds_of_two_ranks_over_one": two["processor_seconds"] / one["processor_seconds"],
        "assumed_seconds_of_latency": LATENCY,
        "assumed_bytes_per_second": BAND_WIDTH,
        "measured": [_row(words, run, one) for words, run in (("1", one), ("2", two), ("1 beside 1", beside))],
        "pair_balance": [_balance(history, number) for number in _MANY],
        "pallet": [estimate(history, measured, _ROUNDS, number, _FINE) for number in _MANY],
        "weak": [_weak(history, measured, number) for number in _MANY],
    }


def measured_by(one: dict[str, Any], two: dict[str, Any]) -> Measured:
    """What the estimate starts from, by what one rank and two have found."""
    cells = one["cells"]
    # Of a rank's memory, so much goes with its own cells and so much with all of them: two equations.
    own = (one["memory_bytes"] - two["memory_bytes"]) / (0.5 * cells)
    every = (two["memory_bytes"] - two["base_bytes"]) / cells - 0.5 * own
    return Measured(
        cells=cells,
        cell_size=_SIZE,
        seconds_per_cell_step=(one["processor_seconds"] - one["seconds_searching"]) / one["cell_steps"],
        cell_steps=one["cell_steps"],
        exchanges=two["exchanges"],
        contacts=one["contacts"],
        searches=one["searches"],
        seconds_per_search=one["seconds_searching"] / one["searches"],
        near=two["halo_nodes"],
        searched=two["searched_nodes"],
        bytes_per_own_cell=own,
        bytes_per_cell=every,
        base_bytes=two["base_bytes"],
    )


def _started(number: int, levels: Path, binding: tuple[str, ...]) -> subprocess.Popen[str]:
    """A burst of the pair on `number` ranks; one rank leaves its levels in a file."""
    command = [sys.executable, "-m", "benchmarks.rank_run", _PAIR, f"{1e3 * _SIZE:g} mm", repr(_END), str(levels)]
    # MPI, once it runs here, adds variables behind Python's back with which no further mpirun starts.
    environment = dict(os.environ)
    return subprocess.Popen(
        ["mpirun", "-n", str(number), *binding, *command],
        cwd=_ROOT, env=environment, stdout=subprocess.PIPE, text=True,
    )  # fmt: skip


def _finished(run: subprocess.Popen[str]) -> dict[str, Any]:
    """What it has found."""
    output, _ = run.communicate()
    if run.returncode:
        raise subprocess.CalledProcessError(run.returncode, run.args)
    figures: dict[str, Any] = json.loads(output.splitlines()[-1])
    return figures


def _history(path: Path) -> History:
    rounds = burst_rounds(load_case(_ROOT / _PAIR, cell_size=f"{1e3 * _SIZE:g} mm"))
    with np.load(path) as file:
        return History(mesh_of(rounds, _SIZE), tuple(rounds), file["duration"], file["step"], file["level"])


def _row(words: str, run: dict[str, Any], one: dict[str, Any]) -> dict[str, Any]:
    return {
        "ranks": words,
        "seconds": run["seconds"],
        "one_over_it": one["seconds"] / run["seconds"],
        "processor_seconds": run["processor_seconds"],
        "balance": run["imbalance"],
        "seconds_waiting": run["seconds_waiting"],
        "seconds_sending": run["seconds_sending"],
        "seconds_searching": run["seconds_searching"],
        "exchanges": run["exchanges"],
        "bytes_per_exchange": run["bytes_per_exchange"],
        "halo_nodes": run["halo_nodes"],
        "searched_nodes": run["searched_nodes"],
    }


def _balance(history: History, number: int) -> dict[str, Any]:
    """Balance of the recorded pair itself, in slabs and in sectors."""
    mesh, times, cost = history.mesh, (history.duration, history.step), cost_of(history.mesh)
    row: dict[str, Any] = {"ranks": number, "cells": len(mesh.cells) // number}
    for words, owner in (("slabs", slabs(mesh, number)), ("sectors", partition(mesh, history.rounds, number))):
        nodes, neighbours = shared_nodes(mesh, owner, number)
        row |= {
            f"{words}_balance": balance(times, history.level, owner, number, cost),
            f"{words}_shared_nodes": nodes,
            f"{words}_neighbours": neighbours,
        }
    return row


def _weak(history: History, measured: Measured, number: int) -> dict[str, Any]:
    """As many rounds as ranks up to the whole pallet, then finer cells: as many cells a rank always."""
    per_round = max(number // _ROUNDS, 1)
    return estimate(history, measured, min(number, _ROUNDS), number, _SIZE / per_round ** (1.0 / 3.0))
