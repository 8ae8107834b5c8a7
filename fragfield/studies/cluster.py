"""Runs on the machines of a dask cluster: `--scheduler ADDRESS`, where `dask scheduler` and `dask worker` are running.

A run is made in the process of a dask worker, one at a time in each. Where a worker is lost, the scheduler gives its
run to another one.
"""

from __future__ import annotations

import threading
import time
import uuid
from contextlib import suppress
from pathlib import Path
from typing import Any

from fragfield.errors import EXIT_FAULT, EXIT_INTERRUPTED, InputError
from fragfield.studies.processes import perform
from fragfield_base.interruption import end_requested
from fragfield_base.writing import locked

_ANSWER = 20.0  # s for the scheduler to answer
_LOOK = 1.0  # s between two looks whether the work was interrupted
_PAUSE = 0.5
_at_work = threading.Lock()
_ended: set[str] = set()
"""On a dask worker: one run at a time, and the studies that were interrupted."""


class ClusterRuns:
    """Makes runs on whichever dask worker is free, see `fragfield.studies.runner.Runs`.

    Parameters
    ----------
    scheduler : str
        Its address, for example "tcp://node1:8786".
    threads : int
        Threads of a run.
    jobs, most : int
        Runs at one time; left out: as many as there are workers. Never more than `most`.

    Raises
    ------
    InputError
        dask.distributed is not installed, no scheduler answers, or it has no workers.
    """

    def __init__(self, scheduler: str, threads: int, jobs: int | None, most: int) -> None:
        try:
            from distributed import Client
        except ImportError:
            raise InputError(
                '--scheduler needs dask.distributed, which is not installed: pip install "fragfield[cluster]"'
            ) from None
        try:
            self._client = Client(scheduler, timeout=_ANSWER, set_as_default=False)
        except (OSError, ValueError, TimeoutError) as error:
            raise InputError(
                f"--scheduler: found {scheduler!r}: no dask scheduler answers there ({error}); allowed: the address "
                "that `dask scheduler` prints, for example tcp://node1:8786"
            ) from None
        workers = len(self._client.nthreads())
        if not workers:
            self._client.close()
            raise InputError(f"--scheduler: found {scheduler!r}: it has no workers; start `dask worker {scheduler}`")
        self.size = min(jobs or workers, most)
        self._threads = threads
        self._study = uuid.uuid4().hex
        self._interrupted = threading.Event()

    def call(self, request: dict[str, Any]) -> tuple[int, str]:
        """Make one run; its exit code and why. Begun again elsewhere where its worker is lost."""
        from distributed import KilledWorker

        if self._interrupted.is_set():
            return EXIT_INTERRUPTED, "interrupted"
        asked = {**request, "threads": self._threads}
        future = self._client.submit(run_here, asked, self._study, key=f"fragfield-{uuid.uuid4().hex}", pure=False)
        while True:
            try:
                code, message = future.result(timeout=_LOOK)
            except TimeoutError:
                if self._interrupted.is_set():
                    future.cancel()
                    return EXIT_INTERRUPTED, "interrupted"
                continue
            except KilledWorker as error:
                return EXIT_FAULT, f"several workers were lost during this run: {error}"
            return int(code), str(message)

    def interrupt(self) -> None:
        """End the runs at hand with their checkpoints, and start no other."""
        self._interrupted.set()
        with suppress(Exception):  # a worker that is lost at this moment has nothing left to end
            self._client.run(end_here, self._study)

    def close(self) -> None:
        """Give the connection back."""
        self._client.close()


def run_here(request: dict[str, Any], study: str) -> tuple[int, str]:
    """On a dask worker: make one run, after those that other threads of the process have begun."""
    with _at_work:
        if study in _ended:
            return EXIT_INTERRUPTED, "interrupted"
        end_requested.clear()
        _await_lock(request)
        return perform(request)


def end_here(study: str) -> None:
    """On every dask worker: end the runs of a study."""
    _ended.add(study)
    end_requested.set()


def _await_lock(request: dict[str, Any]) -> None:
    """Wait while a worker that the scheduler has lost still ends its run in the same directory."""
    until = time.monotonic() + float(request.get("patience") or 0.0)
    while time.monotonic() < until and Path(request["out"]).is_dir():
        try:
            with locked(Path(request["out"]), InputError):
                return
        except InputError:
            time.sleep(_PAUSE)
