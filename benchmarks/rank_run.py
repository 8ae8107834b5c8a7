"""A burst on some ranks, watched: `mpirun -n N python -m benchmarks.rank_run CASE CELL_SIZE END_TIME [LEVELS]`.

`--slabs` cuts the rounds into slabs across the axis instead of sectors.

Rank 0 prints what was found as JSON; a single rank writes its cells' levels to the file LEVELS.
"""

from __future__ import annotations

import json
import resource
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numba
import numpy as np
from mpi4py import MPI

from benchmarks.rank_estimate import slabs
from burst_fenicsx import compat, simulation
from burst_fenicsx.contact.collisions import CollidingSurfaces
from burst_fenicsx.contact.halo import Halo
from burst_fenicsx.mechanics.subcycling import Subcycling
from burst_fenicsx.meshing.distributed import DistributedMesh
from burst_fenicsx.simulation import Simulation
from fragfield.case import load_case
from fragfield.case.conversion.stages import burst_rounds, burst_settings

if TYPE_CHECKING:
    from collections.abc import Callable

    from burst_fenicsx.mechanics.solver import BurstSolver

__all__ = ["Watch", "burst_of"]

_WORD = 8  # bytes


class _TimedComm(MPI.Intracomm):
    """A communicator whose collective calls leave their processor seconds in `idle`."""

    idle = 0.0


def _timed_call(name: str) -> Callable[..., Any]:
    plain = getattr(MPI.Intracomm, name)

    def timed(comm: _TimedComm, *arguments: Any, **named: Any) -> Any:  # noqa: ANN401
        began = time.process_time()
        found = plain(comm, *arguments, **named)
        _TimedComm.idle += time.process_time() - began
        return found

    return timed


for _name in ("allreduce", "Allreduce", "allgather", "alltoall", "bcast", "gather", "Barrier"):
    setattr(_TimedComm, _name, _timed_call(_name))


class Watch:
    """Times and sizes of what ranks do together, taken while a burst is stepped.

    Attributes
    ----------
    exchanges, waiting, sending : nodal exchanges, and seconds in them till all ranks had come, and from then on.
    contacts, near : contact's exchanges, and other ranks' surface nodes in them, summed.
    searches, searching, searched : of contact, processor seconds in them without MPI's, other ranks' nodes sent to it.
    begun, steps, levels : each choice of the cells' steps here: when (s), the longest (s), levels (cells,) int8.
    """

    def __init__(self) -> None:
        self.exchanges = self.contacts = self.near = self.searches = self.searched = 0
        self.waiting = self.sending = self.searching = 0.0
        self.begun: list[float] = []
        self.steps: list[float] = []
        self.levels: list[np.ndarray] = []

    def attach(self, solver: BurstSolver) -> None:
        """Watch a burst from now on."""
        _TimedComm.idle = 0.0
        for name in ("add_to_owners", "send_to_ghosts"):
            setattr(compat, name, self._timed_exchange(getattr(compat, name)))
        sent = Halo._sent

        def timed_sent(halo: Halo, *arguments: Any) -> np.ndarray:
            began = time.process_time()
            received = sent(halo, *arguments)
            _TimedComm.idle += time.process_time() - began
            return received

        Halo._sent = timed_sent  # type: ignore[method-assign]
        force, search = CollidingSurfaces.add_forces, CollidingSurfaces.search
        set_levels = Subcycling.set_levels

        def counted(colliding: CollidingSurfaces, *arguments: Any) -> None:
            self.contacts += 1
            self.near += len(colliding._halo.needed)
            force(colliding, *arguments)

        def timed(colliding: CollidingSurfaces, *arguments: Any) -> None:
            began, idle = time.process_time(), _TimedComm.idle
            search(colliding, *arguments)
            self.searching += time.process_time() - began - (_TimedComm.idle - idle)
            self.searches += 1
            self.searched += colliding.near_faces.received

        def kept(cycles: Subcycling, level: np.ndarray) -> None:
            set_levels(cycles, level)
            self.begun.append(solver.time)
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
            began, idle = time.perf_counter(), time.process_time()
            MPI.COMM_WORLD.Barrier()
            met = time.perf_counter()
            exchange(function)
            _TimedComm.idle += time.process_time() - idle
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


def resident_bytes() -> int:
    """Memory of this process that is resident now."""
    pages = int(Path("/proc/self/statm").read_text(encoding="ascii").split()[1])
    return pages * resource.getpagesize()


def in_slabs() -> None:
    """Have the cells shared out in runs, which are slabs."""
    simulation.partition = lambda mesh, rounds, ranks: slabs(mesh, ranks).astype(np.int32)  # noqa: ARG005


def _main(case: Path, cell_size: str, end_time: float, levels: Path | None) -> None:
    numba.set_num_threads(1)
    DistributedMesh.comm = property(lambda mesh: _TimedComm(mesh.domain.comm))  # type: ignore[assignment, method-assign]
    comm, watch = MPI.COMM_WORLD, Watch()
    base = resident_bytes()
    with tempfile.TemporaryDirectory() as folder:
        run = burst_of(case, cell_size, end_time, Path(folder))
        solver, mesh = run.solver, run.fields.mesh
        watch.attach(solver)
        comm.Barrier()
        began, processor = time.perf_counter(), time.process_time()
        while solver.time < end_time * (1.0 - 1e-12):
            solver.step(end_time)
        processor = time.process_time() - processor
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
            processor - _TimedComm.idle,
            watch.searched / max(watch.searches, 1),
            resident_bytes(),
            base,
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
            "processor_seconds": float(of_all[:, 7].sum()),
            "processor_seconds_of_busiest": float(of_all[:, 7].max()),
            "searched_nodes": float(of_all[:, 8].max()),
            "memory_bytes": float(of_all[:, 9].mean()),
            "base_bytes": float(of_all[:, 10].mean()),
        }
        if levels is not None and comm.size == 1:
            # In the order of the mesh, whose cells ranks share out in runs.
            ordered = np.empty((len(watch.levels), mesh.cells), dtype=np.int8)
            ordered[:, mesh.cell] = watch.levels
            duration = np.diff([*watch.begun, end_time])
            np.savez(levels, step=watch.steps, duration=duration, level=ordered)
        print(json.dumps(figures))


if __name__ == "__main__":
    given = [argument for argument in sys.argv[1:] if argument != "--slabs"]
    if len(given) < len(sys.argv) - 1:
        in_slabs()
    _main(Path(given[0]), given[1], float(given[2]), Path(given[3]) if len(given) > 3 else None)
