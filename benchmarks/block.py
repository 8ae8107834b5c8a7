"""A block of 64,000 steel bricks that flow, without contact: the body and the unit that other codes quote."""

from __future__ import annotations

from functools import cache
from typing import TYPE_CHECKING, Any

import numpy as np
from mpi4py import MPI

from benchmarks.timing import all_threads, best_of, on_threads
from burst_fenicsx.materials.library import load_casing, load_explosive
from burst_fenicsx.mechanics.detonation import LeakageParts
from burst_fenicsx.mechanics.fields import make_fields
from burst_fenicsx.mechanics.ledger import MIN_WORK, Ledger
from burst_fenicsx.mechanics.solver import BurstSolver
from burst_fenicsx.meshing import HexahedralMesh
from burst_fenicsx.meshing.distributed import distribute
from burst_fenicsx.problem import BurstSettings, Leakage, Part, Round, TimeStep

if TYPE_CHECKING:
    from benchmarks.options import Options

__all__ = ["block", "stretched_block"]

_EDGE = 40  # bricks
_SIZE = 3e-3  # m
_RATE = 1e4  # 1/s, of stretching along z
_WARM_STEPS = 30  # until nearly all of it flows
_CALLS, _REPEATS = 10, 4


def stretched_block(edge: int) -> BurstSolver:
    """A cube of `edge`^3 bricks of the paper's steel, stretched at constant volume; every step takes all."""
    mesh = _cube(edge)
    settings = BurstSettings(
        cell_size=_SIZE, leakage=Leakage(enabled=False), time_step=TimeStep(subcycling=False), energy_tolerance=np.inf
    )
    comm = MPI.COMM_SELF
    here = distribute(comm, mesh)
    nowhere, none = np.zeros((0, 3)), np.zeros(0)
    leakage = LeakageParts.of_charges(settings.leakage, comm, np.zeros(0, dtype=np.int32), nowhere, none, nowhere, 0)
    item = Round(name="block", explosive=load_explosive("tnt"), casing=load_casing("steel_paper"), ignition=())
    fields = make_fields(
        here,
        [item],
        settings,
        fuze_density=[1.0],
        axial_part=np.zeros(here.cells, dtype=np.int32),
        leakage=leakage.factor,
        lengths=mesh.lengths,
    )
    solver = BurstSolver(fields, settings, leakage, Ledger(np.inf, MIN_WORK, np.zeros(1), comm))
    fields.nodes.velocity[:] = _RATE * np.array([-0.5, -0.5, 1.0]) * fields.nodes.position
    return solver


def _cube(edge: int) -> HexahedralMesh:
    """Bricks of one casing about the origin."""
    number = np.arange((edge + 1) ** 3).reshape((edge + 1,) * 3)
    corners = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)]
    cells = np.stack([number[x : x + edge, y : y + edge, z : z + edge].ravel() for x, y, z in corners], axis=1)
    along = _SIZE * (np.arange(edge + 1) - 0.5 * edge)
    nodes = np.stack(np.meshgrid(along, along, along, indexing="ij"), axis=-1).reshape(-1, 3)
    none = np.zeros(len(cells), dtype=np.int32)
    return HexahedralMesh(
        nodes=nodes,
        cells=cells.astype(np.int64),
        part=np.full(len(cells), Part.CASING, dtype=np.int32),
        round=none,
        segment=none.copy(),
        station=nodes[cells].mean(axis=1)[:, 2] - along[0],
        lengths=(edge * _SIZE,),
    )


def block(options: Options) -> dict[str, Any]:  # noqa: ARG001 - as every benchmark
    """Cells and steps a second on one thread and on two."""
    solver = _flowing()
    cells = solver.fields.mesh.cells
    figures: dict[str, Any] = {
        "cells": cells,
        "share_yielded": float((solver.fields.solid.shear_strain[:cells, 0] > 0.0).mean()),
    }

    def steps_on(number: int) -> None:
        with on_threads(number):
            for _ in range(_CALLS):
                solver.step()

    numbers = sorted({1, min(2, all_threads())})
    times = best_of(_REPEATS, {str(n): (1, lambda n=n: steps_on(n)) for n in numbers})  # type: ignore[misc]
    for n in numbers:
        figures[f"cell_steps_per_second_on_{n}"] = _CALLS * cells / times[str(n)]
    return figures


@cache
def _flowing() -> BurstSolver:
    solver = stretched_block(_EDGE)
    for _ in range(_WARM_STEPS):
        solver.step()
    return solver
