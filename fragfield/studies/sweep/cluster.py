"""Runs on the machines of a dask cluster: `--scheduler ADDRESS`, where `dask scheduler` and `dask worker` are running.

Each thread of a dask worker holds a process of its own for runs, as a sweep on one machine does, so that compiled
kernels stay. Where a worker is lost, the scheduler gives its run to another one.
"""

from __future__ import annotations

import threading
import time
import uuid
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_FAULT, EXIT_INTERRUPTED, InputError
from fragfield.studies.sweep.worker import Worker
from fragfield_base.locking import locked

if TYPE_CHECKING:
    from collections.abc import Sequence

    from fragfield.studies.sweep.sharing import AnyWorker

__all__ = ["ClusterWorker", "cluster_workers"]

_ANSWER = 20.0  # s for the scheduler to answer
_LOOK = 1.0  # s between two looks whether the work was interrupted
_PAUSE = 0.5

_pools: dict[str, list[Worker]] = {}
"""On a dask worker: processes that wait for a run, by the token of the sweep."""
_busy: dict[str, list[Worker]] = {}
_guard = threading.Lock()


def cluster_workers(scheduler: str, threads: int, jobs: int | None, most: int) -> Sequence[AnyWorker]:
    """Connect to a scheduler.

    Parameters
    ----------
    scheduler : str
        Its address, for example "tcp://node1:8786".
    threads : int
        Threads of a run.
    jobs, most : int
        Runs at one time; left out: as many as the cluster's workers have threads. Never more than `most`.

    Raises
    ------
    InputError
        dask.distributed is not installed, no scheduler answers, or it has no workers.
    """
    try:
        from distributed import Client
    except ImportError:
        raise InputError(
            '--scheduler needs dask.distributed, which is not installed: pip install "fragfield[cluster]"'
        ) from None
    try:
        client = Client(scheduler, timeout=_ANSWER, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"--scheduler: found {scheduler!r}: no dask scheduler answers there ({error}); allowed: the address that "
            "`dask scheduler` prints, for example tcp://node1:8786"
        ) from None
    found = sum(client.nthreads().values())
    if not found:
        client.close()
        raise InputError(f"--scheduler: found {scheduler!r}: it has no workers; start `dask worker {scheduler}`")
    link = _Link(client, uuid.uuid4().hex)
    return [ClusterWorker(link, threads) for _ in range(min(jobs or found, most))]


class _Link:
    """The connection that the workers of one sweep share; closed with the last of them."""

    def __init__(self, client: Any, token: str) -> None:  # noqa: ANN401 - distributed is an extra
        self.client = client
        self.token = token
        self.ended = False
        self._users = 0
        self._lock = threading.Lock()

    def enter(self) -> None:
        with self._lock:
            self._users += 1

    def leave(self) -> None:
        with self._lock:
            self._users -= 1
            last = self._users == 0
        if last:
            with suppress(Exception):  # a worker that is lost at this moment has nothing left to close
                self.client.run(end_pool, self.token)
            self.client.close()

    def interrupt(self) -> None:
        with self._lock:
            if self.ended:
                return
            self.ended = True
        with suppress(Exception):
            self.client.run(interrupt_pool, self.token)


class ClusterWorker:
    """Makes one run after another on whichever dask worker is free; see `fragfield.studies.sweep.sharing.AnyWorker`."""

    def __init__(self, link: _Link, threads: int) -> None:
        self._link = link
        self._threads = threads
        link.enter()

    def call(self, request: dict[str, Any]) -> tuple[int, str]:
        """Make one run; its exit code and why. Begun again elsewhere where its worker is lost."""
        from distributed import KilledWorker

        if self._link.ended:
            return EXIT_INTERRUPTED, "interrupted"
        future = self._link.client.submit(
            run_here, request, self._threads, self._link.token, key=f"fragfield-{uuid.uuid4().hex}", pure=False
        )
        while True:
            try:
                code, message = future.result(timeout=_LOOK)
            except TimeoutError:
                if self._link.ended:
                    future.cancel()
                    return EXIT_INTERRUPTED, "interrupted"
                continue
            except KilledWorker as error:
                return EXIT_FAULT, f"several workers were lost during this run: {error}"
            return int(code), str(message)

    def interrupt(self) -> None:
        """End the runs at hand with their checkpoints, and start no other."""
        self._link.interrupt()

    def close(self) -> None:
        """Give the connection back."""
        self._link.leave()


def run_here(request: dict[str, Any], threads: int, token: str) -> tuple[int, str]:
    """On a dask worker: make one run in a process of this worker."""
    _await_lock(request)
    with _guard:
        free = _pools.setdefault(token, [])
        worker = free.pop() if free else Worker(threads)
        _busy.setdefault(token, []).append(worker)
    try:
        return worker.call(request)
    finally:
        with _guard:
            _busy[token].remove(worker)
            _pools.setdefault(token, []).append(worker)


def _await_lock(request: dict[str, Any]) -> None:
    """Wait while the process of a lost worker still ends its run in the same directory."""
    until = time.monotonic() + float(request.get("patience") or 0.0)
    while time.monotonic() < until and Path(request["out"]).is_dir():
        try:
            with locked(Path(request["out"]), InputError):
                return
        except InputError:
            time.sleep(_PAUSE)


def interrupt_pool(token: str) -> None:
    """On every dask worker: end the runs of a sweep at hand."""
    with _guard:
        for worker in [*_busy.get(token, []), *_pools.get(token, [])]:
            worker.interrupt()


def end_pool(token: str) -> None:
    """On every dask worker: end the processes of a sweep."""
    with _guard:
        workers = _pools.pop(token, [])
        _busy.pop(token, None)
    for worker in workers:
        worker.close()
