"""One rank against two, and from what they measure an estimate of many: kernel rates, message sizes, what is repeated.

The pair of M107 is stepped on ranks of one thread each. The estimate is a sum of four parts for each rank: its cells
at the measured rate, with the balance that the measured levels have in runs of cells; the exchange of shared nodes,
counted in the partition itself; the exchange of contact; and what every rank repeats in a search. Only the network is
assumed.
"""

from __future__ import annotations

import json
import math
import subprocess
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from benchmarks.goal import at_least
from burst_fenicsx.meshing import merge, mesh_round
from burst_fenicsx.meshing.split import split_charges
from fragfield.case import load_case
from fragfield.case.conversion.stages import burst_rounds

if TYPE_CHECKING:
    from benchmarks.options import Options
    from burst_fenicsx.meshing import HexahedralMesh

__all__ = ["balance", "estimate", "ranks", "shared_nodes"]

_ROOT = Path(__file__).resolve().parent.parent
_PAIR, _PALLET = "cases/m107_pair.toml", "cases/m107_pallet_2x4.toml"
_SIZE, _END = 6e-3, 120e-6  # m, s: what is measured
_TARGET = 1.8
_REPEATS = 2
_MANY = (64, 1024)
_LATENCY, _BAND_WIDTH = 2e-6, 10e9  # s and B/s: of a common network, for each rank
_OF_NODE = 24  # bytes of a vector
_OF_NEAR = 88  # bytes of another rank's surface node in contact's exchange: place, velocity, load; force and load back


@dataclass(frozen=True)
class Problem:
    """What is estimated: a case and its cell size (m)."""

    words: str
    case: str
    cell_size: float


_PROBLEMS = (Problem("pair, 3 mm", _PAIR, 3e-3), Problem("pallet of 8, 2 mm", _PALLET, 2e-3))


def ranks(options: Options) -> dict[str, Any]:
    """Time on one rank and on two, and the estimate for many."""
    del options
    with tempfile.TemporaryDirectory(prefix="fragfield-bench-") as folder:
        kept = Path(folder) / "levels.npz"
        found = {n: min((_measured(n, kept) for _ in range(_REPEATS)), key=lambda run: run["seconds"]) for n in (1, 2)}
        with np.load(kept) as file:
            steps, levels = file["step"], file["level"]
    one, two = found[1], found[2]
    measured = [
        {
            "ranks": n,
            "seconds": run["seconds"],
            "one_over_it": one["seconds"] / run["seconds"],
            "balance": run["imbalance"],
            "seconds_waiting": run["seconds_waiting"],
            "seconds_sending": run["seconds_sending"],
            "seconds_searching": run["seconds_searching"],
            "exchanges": run["exchanges"],
            "bytes_per_exchange": run["bytes_per_exchange"],
            "halo_nodes": run["halo_nodes"],
        }
        for n, run in found.items()
    ]
    return {
        "cells": one["cells"],
        **at_least(one["seconds"] / two["seconds"], _TARGET, "one rank over two, one thread each"),
        "slower_beside_another": _slower_together(one, two),
        "assumed_seconds_of_latency": _LATENCY,
        "assumed_bytes_per_second": _BAND_WIDTH,
        "measured": measured,
        "estimated": [estimate(problem, n, one, two, steps, levels) for problem in _PROBLEMS for n in _MANY],
    }


def _measured(number: int, levels: Path) -> dict[str, Any]:
    """A burst of the pair on `number` ranks; one rank leaves its levels in a file."""
    command = [sys.executable, "-m", "benchmarks.rank_run", _PAIR, f"{1e3 * _SIZE:g} mm", repr(_END), str(levels)]
    done = subprocess.run(
        ["mpirun", "-n", str(number), *command], cwd=_ROOT, stdout=subprocess.PIPE, text=True, check=True
    )
    figures: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    return figures


def estimate(
    problem: Problem, number: int, one: dict[str, Any], two: dict[str, Any], steps: np.ndarray, levels: np.ndarray
) -> dict[str, Any]:
    """Seconds of each part on `number` ranks, and the efficiency: what one rank would take over all ranks' time.

    `one` and `two` are what one and two ranks have measured; `steps` (s) and `levels` (choices, cells) of the one.
    Cells grow with the cube of the finer cells, surfaces with the square, steps with the size itself.
    """
    mesh, finer = _mesh(problem), _SIZE / problem.cell_size
    rounds = len(mesh.segments) / 2.0  # over the pair's
    nodes, neighbours = shared_nodes(mesh, number)
    per_round = max(round(2 * number / len(mesh.segments)), 1)
    uneven = balance(steps, levels, min(per_round, levels.shape[1]))
    cell_steps = one["cell_steps"] * finer * len(mesh.cells) / one["cells"]
    exchanges = two["exchanges"] * finer
    contacts, halo = one["contacts"] * finer, two["halo_nodes"] * finer**2
    search = one["seconds_searching"] / one["searches"]
    of_both = 2.0 * two["seconds_searching"] / two["searches"] / max(_slower_together(one, two), 1.0)
    repeated = float(np.clip(of_both / search - 1.0, 0.0, 1.0))
    search *= finer**2 * rounds
    of_cells = (one["seconds"] - one["seconds_searching"]) / one["cell_steps"]
    parts = {
        "seconds_of_cells": of_cells * cell_steps / number * uneven,
        "seconds_of_nodes": exchanges * (neighbours * _LATENCY + _OF_NODE * nodes / _BAND_WIDTH),
        "seconds_of_contact": contacts
        * (2.0 * math.log2(number) * _LATENCY + 2.0 * neighbours * _LATENCY + _OF_NEAR * halo / _BAND_WIDTH),
        "seconds_of_searches": one["searches"] * finer * search * (repeated + (1.0 - repeated) / number),
    }
    alone = of_cells * cell_steps + one["searches"] * finer * search
    return {
        "what": problem.words,
        "ranks": number,
        "cells": len(mesh.cells) / number,
        "balance": uneven,
        "shared_nodes": nodes,
        **parts,
        "efficiency": alone / number / sum(parts.values()),
    }


def _slower_together(one: dict[str, Any], two: dict[str, Any]) -> float:
    """How much slower a process works beside another on this machine, by what two take for the cells of one."""
    busy = two["seconds"] - two["seconds_waiting"] - two["seconds_sending"] - two["seconds_searching"]
    slower: float = 2.0 * busy / (one["seconds"] - one["seconds_searching"])
    return slower


def _mesh(problem: Problem) -> HexahedralMesh:
    case = load_case(_ROOT / problem.case, cell_size=f"{1e3 * problem.cell_size:g} mm")
    rounds = burst_rounds(case)
    return split_charges(merge([mesh_round(item, problem.cell_size, i) for i, item in enumerate(rounds)]))


def shared_nodes(mesh: HexahedralMesh, number: int) -> tuple[int, int]:
    """Most nodes that a rank shares with others, and most neighbours that a rank has, for runs of cells."""
    owner = np.arange(len(mesh.cells), dtype=np.int64) * number // len(mesh.cells)
    # Twins count as one place: where one is on a rank, so is the other.
    pairs = np.unique(mesh.places[mesh.cells].ravel() * number + np.repeat(owner, 8))
    node, rank = pairs // number, pairs % number
    several = np.bincount(node)[node] > 1
    node, rank = node[several], rank[several]
    most = int(np.bincount(rank, minlength=number).max(initial=0))
    # Pairs lie by node: those of one node follow each other.
    neighbours: set[tuple[int, int]] = set()
    for apart in range(1, int(np.bincount(node).max(initial=1))):
        same = node[apart:] == node[:-apart]
        neighbours |= set(zip(rank[:-apart][same].tolist(), rank[apart:][same].tolist(), strict=True))
    of_rank = np.bincount(np.array(list(neighbours), dtype=np.int64).ravel(), minlength=number)
    return most, int(of_rank.max(initial=0))


def balance(steps: np.ndarray, levels: np.ndarray, number: int) -> float:
    """Time with runs of cells on `number` ranks over that with equal work: all wait for the slowest in every step.

    `steps` (choices,) s are the macro steps chosen, `levels` (choices, cells) the cells' levels.
    """
    owner = np.arange(levels.shape[1], dtype=np.int64) * number // levels.shape[1]
    slowest = mean = 0.0
    for step, level in zip(steps, levels, strict=True):
        for min_level in range(int(level.max()) + 1):
            active = np.bincount(owner[level >= min_level], minlength=number)
            parts = 2 ** max(min_level - 1, 0) / step  # of the steps in a second
            slowest += parts * active.max()
            mean += parts * active.mean()
    return slowest / mean
