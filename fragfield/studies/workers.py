"""Where the runs of a study are made: in processes of this machine, or by the workers of a dask cluster.

Both submit to an executor of `concurrent.futures`. Processes stay for many runs: imports take longer than a small
burst.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
import time
import uuid
from collections import Counter, deque
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from types import ModuleType
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_INTERRUPTED, InputError
from fragfield.files.provenance import revision
from fragfield.studies.tasks import Outcome, Task, perform
from fragfield_base.ambient import settle_child
from fragfield_base.cores import cores
from fragfield_base.interruption import end_requested
from fragfield_base.version import __version__

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator
    from concurrent.futures import Future
    from multiprocessing.connection import Connection
    from types import FrameType


_WAIT = 0.2  # s; a wait without end would not see Ctrl-C on every system
_ANSWER = 20.0  # s for a scheduler to answer
_TRIES = 3  # of a run whose process was killed
_working = threading.Event()
"""In a process of `Processes`: whether a run is at hand."""
_one_run = threading.Lock()
_ended: set[str] = set()
"""In a dask worker: one run at a time, and the studies that were interrupted."""


def workers_of(scheduler: str | None, most: int, *, jobs: int | None, threads: int) -> Processes | Cluster:
    """Processes of this machine, or the workers of the cluster with this scheduler; at most `most`, or `jobs`."""
    if scheduler is not None:
        return Cluster(scheduler, jobs, most)
    return Processes(min(jobs or max(cores() // threads, 1), most), threads)


def make_all(
    workers: Processes | Cluster,
    tasks: Iterable[Task],
    ended: Callable[[Task, Outcome], None],
    begun: Callable[[Task], None] = lambda _: None,
) -> None:
    """Make runs, as many at one time as `workers` has, and report the end of each in this thread.

    Where a process is killed, the runs at hand are made again one by one: none that ends its process takes another with
    it. `workers` is closed at the end, and interrupted first where an error or Ctrl-C ends the work.
    """
    waiting, again, tries = iter(tasks), deque[Task](), Counter[str]()
    announced: set[str] = set()
    at_hand: dict[Future[Outcome], Task] = {}
    try:
        while True:
            alone = bool(again) or any(tries[task.name] for task in at_hand.values())
            while len(at_hand) < (1 if alone else workers.size):
                task = again.popleft() if again else next(waiting, None)
                if task is None:
                    break
                if task.name not in announced:
                    announced.add(task.name)
                    begun(task)
                try:
                    at_hand[workers.submit(task)] = task
                except BrokenExecutor:  # a process was killed while it was idle, or a moment ago
                    again.append(task)
                    if not at_hand:
                        workers.restart()
                    break
            if not at_hand and not again:
                return
            done = wait(at_hand, timeout=_WAIT, return_when=FIRST_COMPLETED).done
            killed = [future for future in done if isinstance(future.exception(), BrokenExecutor)]
            for future in done.difference(killed):
                error = future.exception()
                outcome = future.result() if error is None else Outcome.of(error)
                if outcome.code == EXIT_INTERRUPTED:
                    raise KeyboardInterrupt
                ended(at_hand.pop(future), outcome)
                del future  # a cluster makes a run again whose result is held here and lost there
            del done
            if killed:
                workers.restart()
                for task in at_hand.values():
                    tries[task.name] += 1
                    if tries[task.name] < _TRIES:
                        again.append(task)
                    else:
                        ended(task, Outcome.killed(_TRIES))
                at_hand.clear()
    except BaseException:
        workers.interrupt()
        raise
    finally:
        workers.close()


class Processes:
    """Processes of this machine, each of so many threads.

    They have sessions of their own, so that Ctrl-C does not reach them: a second signal would break the checkpoint that
    the first one makes them write. They end with a pipe that this process holds, and so when it is killed, too.
    """

    def __init__(self, size: int, threads: int, function: Callable[[Task], Outcome] = perform) -> None:
        self.size = size
        self._threads, self._function = threads, function
        self._context = multiprocessing.get_context("spawn")
        self._held_there, self._held_here = self._context.Pipe(duplex=False)
        self._pool: ProcessPoolExecutor | None = None

    def submit(self, task: Task) -> Future[Outcome]:
        """Begin a run, in a new process where fewer than `size` are there."""
        if self._pool is None:
            ready = (self._threads, self._held_there)
            self._pool = ProcessPoolExecutor(self.size, self._context, _prepare, ready)
        with _without_main():
            return self._pool.submit(_perform, self._function, task)

    def restart(self) -> None:
        """Leave a pool of which a process was killed."""
        self.close()

    def interrupt(self) -> None:
        """End the runs at hand with their checkpoints, and begin no other."""
        self._held_here.close()

    def close(self) -> None:
        """End the processes, once the runs at hand have ended."""
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown(cancel_futures=True)


@contextmanager
def _without_main() -> Iterator[None]:
    """Start processes that do not run the caller's script again, as Python's would, to know its functions."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _prepare(threads: int, held: Connection) -> None:
    """In a new process: a session of its own, its threads, and an end with the process that gives the work."""
    os.setsid()
    settle_child(InputError)
    os.environ["NUMBA_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(threads)  # read when numba is loaded
    os.dup2(2, 1)  # what a library prints is no result of the command
    signal.signal(signal.SIGTERM, _interrupt)
    threading.Thread(target=_end_with, args=(held,), daemon=True).start()


def _perform(function: Callable[[Task], Outcome], task: Task) -> Outcome:
    _working.set()
    try:
        return function(task)
    finally:
        _working.clear()


def _interrupt(number: int, frame: FrameType | None) -> None:
    del number, frame
    if not _working.is_set():
        os._exit(EXIT_INTERRUPTED)
    raise KeyboardInterrupt


def _end_with(held: Connection) -> None:
    """End the run at hand, with its checkpoint, and the process, once the other end of a pipe is closed."""
    with suppress(EOFError, OSError):
        held.recv_bytes()
    os.kill(os.getpid(), signal.SIGTERM)
    while _working.is_set():
        time.sleep(_WAIT)
    os._exit(EXIT_INTERRUPTED)


class Cluster:
    """The workers of a dask cluster, one run at a time in each; where one is lost, its run begins again elsewhere.

    Raises InputError: dask.distributed is not installed, no scheduler answers, it has no workers, or one has another
    version of the program.
    """

    def __init__(self, scheduler: str, jobs: int | None, most: int) -> None:
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
        own = build_here()
        for address, found in self._client.run(build_here, on_error="return").items():
            if found != own:
                self._client.close()
                raise InputError(
                    f"--scheduler: found the worker {address} with {found}; allowed: {own}, as here: the rows of a "
                    "study are of one program"
                )
        self.size = min(jobs or workers, most)
        self._build = own
        self._executor: Any = self._client.get_executor(pure=False)
        self._study = uuid.uuid4().hex

    def submit(self, task: Task) -> Future[Outcome]:
        """Begin a run on whichever worker is free."""
        future: Future[Outcome] = self._executor.submit(perform_in_turn, task, self._study, self._build)
        return future

    def restart(self) -> None:
        """Nothing: the scheduler gives the runs of a lost worker to others."""

    def interrupt(self) -> None:
        """End the runs at hand with their checkpoints, and begin no other."""
        self._executor.shutdown(wait=False)
        with suppress(Exception):  # a worker that is lost at this moment has nothing left to end
            self._client.run(end_here, self._study)

    def close(self) -> None:
        """Give the connection back."""
        self._client.close()


def build_here() -> str:
    """In every dask worker, and where the study is made: the version of the program."""
    return " ".join(["fragfield", __version__, *filter(None, [revision()])])


def perform_in_turn(task: Task, study: str, build: str) -> Outcome:
    """In a dask worker: make one run, after those that other threads of the process have begun."""
    if build != (own := build_here()):  # of a worker that came later
        return Outcome.of(InputError(f"the worker has {own}; allowed: {build}, as the study has"))
    with _one_run:
        if study in _ended:
            return Outcome.of(KeyboardInterrupt())
        end_requested.clear()
        return perform(task)


def end_here(study: str) -> None:
    """In every dask worker: end the runs of a study."""
    _ended.add(study)
    end_requested.set()
