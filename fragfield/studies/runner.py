"""Makes the runs of a study side by side, in processes of this machine or on the workers of a dask cluster."""

from __future__ import annotations

from concurrent.futures import FIRST_COMPLETED, ThreadPoolExecutor, wait
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

from fragfield_base.cores import cores

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence


_WAIT = 0.2  # s; a wait without end would not see Ctrl-C on every system

Outcome = TypeVar("Outcome")


class Runs(Protocol):
    """What makes runs: `fragfield.studies.processes.LocalRuns`, or `fragfield.studies.cluster.ClusterRuns`."""

    size: int
    """Runs at one time."""

    def call(self, request: dict[str, Any]) -> tuple[int, str]:
        """Make one run, from any thread; its exit code and, where that is not 0, why."""

    def interrupt(self) -> None:
        """End the runs at hand with their checkpoints, and start no other."""

    def close(self) -> None:
        """End the processes, once the runs at hand have ended."""


def runs_of(scheduler: str | None, most: int, *, jobs: int | None = None, threads: int = 1) -> Runs:
    """Processes of this machine, or the workers of the dask cluster with this scheduler; at most `most`, or `jobs`."""
    if scheduler is not None:
        from fragfield.studies.cluster import ClusterRuns

        return ClusterRuns(scheduler, threads, jobs, most)
    from fragfield.studies.processes import LocalRuns

    return LocalRuns(min(jobs or max(cores() // threads, 1), most), threads)


def make_all(
    runs: Runs, numbers: Sequence[int], make: Callable[[int], Outcome], ended: Callable[[int, Outcome], None]
) -> None:
    """Make the runs with these numbers, as many at one time as `runs` allows, and report every end in this thread.

    `runs`: closed at the end, and interrupted first where an error or Ctrl-C ends the work; `numbers`: runs, in the
    order in which they are begun; `make`: makes a run by `runs.call`, in a thread; `ended`: called with a run's number
    and what `make` returned. Raises BaseException: what `make` or `ended` raised; no further run is begun.
    """
    with ThreadPoolExecutor(runs.size) as threads:
        try:
            waiting = {threads.submit(make, number): number for number in numbers}
            while waiting:
                for future in wait(waiting, timeout=_WAIT, return_when=FIRST_COMPLETED).done:
                    ended(waiting.pop(future), future.result())
        except BaseException:
            threads.shutdown(wait=False, cancel_futures=True)
            runs.interrupt()
            raise
        finally:
            threads.shutdown()
            runs.close()
