"""From rounds and settings to a finished burst, in three dimensions or in the meridian."""

from __future__ import annotations

from contextlib import contextmanager, nullcontext
from typing import TYPE_CHECKING

import numba
from mpi4py import MPI

from burst_fenicsx.simulation import Simulation

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping, Sequence
    from pathlib import Path

    from burst_fenicsx.problem import BurstSettings, Round
    from burst_fenicsx.simulation import BurstProgress, BurstResult


def simulate(
    rounds: Sequence[Round],
    settings: BurstSettings,
    out_dir: Path | None,
    *,
    comm: MPI.Comm | None = None,
    provenance: Mapping[str, str] | None = None,
    on_progress: Callable[[BurstProgress], None] | None = None,
    resume: bool = False,
    series: bool = True,
    keep_mesh: bool = False,
) -> BurstResult:
    """Compute the burst and write burst.xdmf, the folder burst, burst_snapshot.h5 and, while it runs, checkpoint.h5.

    Parameters
    ----------
    rounds : the cased charges.
    settings : how it is computed.
    out_dir : an existing folder; without one nothing is written.
    comm : communicator, by default MPI's world; the call is collective.
    provenance : written into every file.
    on_progress : called on rank 0 about five times a second.
    resume : go on from checkpoint.h5 in `out_dir` where there is one.
    series : write burst.xdmf and what else is for visualisation alone; the snapshot is written in any case.
    keep_mesh : keep the mesh of an axisymmetric burst for the next call with the same profile and cells; one at a time.

    Raises
    ------
    InputError
        The problem cannot be computed.
    NumericalStop
        A cell was lost, the ledger opened, or casings passed through a plane or each other; all outputs written so
        far are whole.
    """
    comm = comm or MPI.COMM_WORLD
    with _one_thread() if settings.geometry == "axisymmetric" else nullcontext():
        simulation = Simulation(
            rounds, settings, out_dir, comm, dict(provenance or {}), on_progress, keep_mesh=keep_mesh
        )
        simulation.writes_series &= series
        if resume and out_dir is not None and simulation.checkpoint_path.exists():
            simulation.resume()
        simulation.run()
        result = simulation.finish()
        if comm.rank == 0 and out_dir is not None:  # kept until the snapshot is whole: nothing is computed twice
            simulation.checkpoint_path.unlink(missing_ok=True)
    return result


@contextmanager
def _one_thread() -> Iterator[None]:
    """Compute on one thread: the shared loops of so small a mesh cost more in waiting for each other than they gain."""
    before = numba.get_num_threads()
    numba.set_num_threads(1)
    try:
        yield
    finally:
        numba.set_num_threads(before)
