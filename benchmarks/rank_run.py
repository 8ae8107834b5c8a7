"""A burst on some ranks, watched: `mpirun -n N python -m benchmarks.rank_run CASE CELL_SIZE END_TIME [LEVELS]`.

Rank 0 prints what was found as JSON; a single rank writes its cells' levels to the file LEVELS.
"""

from __future__ import annotations

import json
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from mpi4py import MPI

from burst_fenicsx import compat
from burst_fenicsx.contact.collisions import CollidingSurfaces
from burst_fenicsx.mechanics.subcycling import Subcycling
from burst_fenicsx.simulation import Simulation
from fragfield.case import load_case
from fragfield.case.conversion.stages import burst_rounds, burst_settings

if TYPE_CHECKING:
    from collections.abc import Callable

__all__ = ["Watch", "burst_of"]

_WORD = 8  # bytes


class Watch:
    """Times and sizes of what ranks do together, taken while a burst is stepped.

    Attributes
    ----------
    exchanges, waiting, sending : nodal exchanges, and seconds in them till all ranks had come, and from then on.
    contacts, near : contact's exchanges, and other ranks' surface nodes in them, summed.
    searches, searching : of contact, and seconds in them.
    steps, levels : each choice of the cells' steps on this rank: the longest (s), and levels (cells,) int8.
    """

    def __init__(self) -> None:
        self.exchanges = self.contacts = self.near = self.searches = 0
        self.waiting = self.sending = self.searching = 0.0
        self.steps: list[float] = []
        self.levels: list[np.ndarray] = []

    def attach(self) -> None:
        """Watch from now on."""
        for name in ("add_to_owners", "send_to_ghosts"):
            setattr(compat, name, self._timed_exchange(getattr(compat, name)))
        force, search = CollidingSurfaces.add_forces, CollidingSurfaces.search
        set_levels = Subcycling.set_levels

        def counted(colliding: CollidingSurfaces, *arguments: Any) -> None:
            self.contacts += 1
            self.near += len(colliding._halo.needed)
            force(colliding, *arguments)

        def timed(colliding: CollidingSurfaces, *arguments: Any) -> None:
            began = time.perf_counter()
            search(colliding, *arguments)
            self.searching += time.perf_counter() - began
            self.searches += 1

        def kept(cycles: Subcycling, level: np.ndarray) -> None:
            set_levels(cycles, level)
            self.steps.append(cycles.step)
            self.levels.append(level.copy())

        for owner, name, function in (
            (CollidingSurfaces, "add_forces", counted),
            (CollidingSurfaces, "search", timed),
            (Subcycling, "set_levels", kept),
        ):
            setattr(owner, name, function)

    def _timed_exchange(self, exchange: Callable[[Any], None]) -> Callable[[Any], None]:
        def timed(function: Any) -> None:  # noqa: ANN401
            began = time.perf_counter()
            MPI.COMM_WORLD.Barrier()
            met = time.perf_counter()
            exchange(function)
            self.exchanges += 1
            self.waiting += met - began
            self.sending += time.perf_counter() - met

        return timed


def burst_of(case: Path, cell_size: str, end_time: float, folder: Path) -> Simulation:
    """The burst of a case file, ready to be stepped on all ranks."""
    found = load_case(case, cell_size=cell_size)
    return Simulation(
        burst_rounds(found),
        replace(burst_settings(found, geometry="3d"), end_time=end_time, symmetry="off"),
        folder,
        MPI.COMM_WORLD,
        {},
    )


def _main(case: Path, cell_size: str, end_time: float, levels: Path | None) -> None:
    numba.set_num_threads(1)
    comm, watch = MPI.COMM_WORLD, Watch()
    with tempfile.TemporaryDirectory() as folder:
        run = burst_of(case, cell_size, end_time, Path(folder))
        solver, mesh = run.solver, run.fields.mesh
        watch.attach()
        comm.Barrier()
        began = time.perf_counter()
        while solver.time < end_time * (1.0 - 1e-12):
            solver.step(end_time)
        comm.Barrier()
        seconds = time.perf_counter() - began
    ghosts = len(mesh.node) - mesh.owned_nodes
    own = np.array(
        [
            solver.cell_steps,
            watch.waiting,
            watch.sending,
            _WORD * 3 * ghosts,
            watch.searching,
            mesh.cells,
            watch.near / max(watch.contacts, 1),
        ],
        dtype=float,
    )
    of_all = np.array(comm.allgather(own))
    if comm.rank == 0:
        figures: dict[str, Any] = {
            "ranks": comm.size,
            "cells": int(of_all[:, 5].sum()),
            "surface_nodes": len(run.contact.collisions.surfaces.node) if run.contact.collisions else 0,
            "seconds": seconds,
            "steps": solver.steps,
            "cell_steps": float(of_all[:, 0].sum()),
            "imbalance": float(of_all[:, 0].max() / of_all[:, 0].mean()),
            "exchanges": watch.exchanges,
            "bytes_per_exchange": float(of_all[:, 3].max()),
            "seconds_waiting": float(of_all[:, 1].mean()),
            "seconds_sending": float(of_all[:, 2].mean()),
            "contacts": watch.contacts,
            "halo_nodes": float(of_all[:, 6].max()),
            "searches": watch.searches,
            "seconds_searching": float(of_all[:, 4].mean()),
        }
        if levels is not None and comm.size == 1:
            # In the order of the mesh, whose cells ranks share out in runs.
            ordered = np.empty((len(watch.levels), mesh.cells), dtype=np.int8)
            ordered[:, mesh.cell] = watch.levels
            np.savez(levels, step=watch.steps, level=ordered)
        print(json.dumps(figures))


if __name__ == "__main__":
    _main(Path(sys.argv[1]), sys.argv[2], float(sys.argv[3]), Path(sys.argv[4]) if len(sys.argv) > 4 else None)
