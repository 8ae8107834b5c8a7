"""Ranks of an MPI launch, for the command line: output by rank 0, waiting, a common end."""

from __future__ import annotations

import importlib
import os
import time
from dataclasses import dataclass
from typing import Any, TypeVar, cast

from fragfield.errors import InputError

Shared = TypeVar("Shared")
_RANK_VARIABLES = ("OMPI_COMM_WORLD_RANK", "PMI_RANK", "PMIX_RANK")
_SIZE_VARIABLES = ("OMPI_COMM_WORLD_SIZE", "PMI_SIZE")
_STEP_SIZE = "SLURM_STEP_NUM_TASKS"  # of srun, which sets it beside PMIX_RANK
_POLL = 0.05  # s between two looks of a waiting rank: a waiting core is free for rank 0's threads
_PATIENCE = 3.0  # s that other ranks leave rank 0 to report an error that all of them see
_TAG = 20_240


def launched_rank() -> int:
    """Rank by the launcher's environment, 0 without a launcher; nothing is imported for it."""
    return next((int(os.environ[name]) for name in _RANK_VARIABLES if os.environ.get(name, "").isdigit()), 0)


def launched_size() -> int:
    """Number of ranks by the launcher's environment, 1 without a launcher.

    PMIx gives a process its rank and no size. Where no other variable holds it, MPI itself is asked: a guess of 1 would
    let every rank begin the whole run.
    """
    names: tuple[str, ...] = _SIZE_VARIABLES
    if os.environ.get("PMIX_RANK", "").isdigit():
        names = (*names, _STEP_SIZE)
    sizes = [int(os.environ[name]) for name in names if os.environ.get(name, "").isdigit()]
    if sizes or not any(os.environ.get(name, "").isdigit() for name in _RANK_VARIABLES):
        return sizes[0] if sizes else 1
    return int(importlib.import_module("mpi4py.MPI").COMM_WORLD.Get_size())


@dataclass(frozen=True)
class Team:
    """The ranks that compute together; `comm` is an mpi4py communicator, None for one process."""

    comm: Any = None

    @classmethod
    def join(cls) -> Team:
        """All ranks of the launch; raises InputError where MPI knows of no others.

        MPI is loaded by name and only under a launcher: other commands start without it.
        """
        if (started := launched_size()) < 2:
            return cls()
        comm = importlib.import_module("mpi4py.MPI").COMM_WORLD
        if comm.Get_size() == 1:
            raise InputError(
                f"found {started} ranks by the launcher's variables, and 1 by MPI: each would make the whole run; the "
                "launcher belongs to another MPI than the one that dolfinx uses, or its variables were left from a run"
            )
        return cls(comm)

    @property
    def of_one(self) -> Team:
        """A team of this rank."""
        return Team(self.alone)

    @property
    def alone(self) -> Any:  # noqa: ANN401 - a communicator of mpi4py
        """A communicator of this rank alone; None for one process."""
        return None if self.comm is None else importlib.import_module("mpi4py.MPI").COMM_SELF

    @property
    def rank(self) -> int:
        """Rank of this process."""
        return 0 if self.comm is None else self.comm.Get_rank()

    @property
    def size(self) -> int:
        """Number of ranks."""
        return 1 if self.comm is None else self.comm.Get_size()

    @property
    def first(self) -> bool:
        """Whether this rank prints and writes."""
        return self.rank == 0

    def broadcast(self, value: Shared | None = None) -> Shared:
        """Rank 0's value, on every rank; the others give none."""
        return cast("Shared", value if self.comm is None else self.comm.bcast(value, root=0))

    def release(self, code: int) -> None:
        """On rank 0: end the wait of the other ranks, which then exit with this code."""
        if self.comm is not None:
            for rank in range(1, self.size):
                self.comm.send(code, dest=rank, tag=_TAG)

    def wait(self) -> int:
        """On other ranks: sleep until rank 0 releases them; its exit code."""
        while not self.comm.Iprobe(source=0, tag=_TAG):
            time.sleep(_POLL)
        return int(self.comm.recv(source=0, tag=_TAG))

    def give_others_time(self) -> None:
        """On other ranks: leave the report of an error to rank 0, which ends them if it sees the same one."""
        if not self.first:
            time.sleep(_PATIENCE)

    def abort(self, code: int) -> None:
        """End every rank with an exit code; without a launcher nothing happens."""
        if self.comm is not None and self.size > 1:
            self.comm.Abort(code)
            os._exit(code)  # MPICH's comes back, and the process lives until the launcher ends it
