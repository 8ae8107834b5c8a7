"""Processes of this machine that make runs one after another: imports take longer than a small burst.

Each is a pool of one process: a run that ends its process then takes no other with it, and is known.
"""

from __future__ import annotations

import multiprocessing
import os
import queue
import signal
import sys
import threading
import time
from concurrent.futures import ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

from fragfield.errors import EXIT_DONE, EXIT_FAULT, EXIT_INTERRUPTED, InputError, exit_code_of, message_of
from fragfield_base.ambient import settle_child

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from multiprocessing.process import BaseProcess
    from types import FrameType

    Task = Callable[[dict[str, Any]], tuple[int, str]]


_WATCH = 0.5  # s between two looks whether the process that gives the work is still there
_starting = threading.Lock()
_working = threading.Event()
"""In a process that makes runs: whether there is one at hand."""


def perform(request: dict[str, Any]) -> tuple[int, str]:
    """Make the run of a request in this process; exit code and message.

    `request`: `stage`, `case_file`, `out`, `resume`, `overwrite` and `threads`. Requests of the stages "sample" and
    "row" have keys of their own, see `fragfield.studies.uncertainty.sample` and `fragfield.studies.sweep.row`, and
    their results as message.
    """
    from fragfield.pipeline.chain import run_chain
    from fragfield.pipeline.job import RunOptions
    from fragfield.terminal.logs import to_stderr

    if request["stage"] == "sample":
        from fragfield.studies.uncertainty.sample import perform_sample

        return perform_sample(request)
    if request["stage"] == "row":
        from fragfield.studies.sweep.row import perform_row

        return perform_row(request)
    asked = RunOptions(
        Path(request["case_file"]), Path(request["out"]), resume=request["resume"], overwrite=request["overwrite"],
        quiet=True, threads=request["threads"], lean=True,
    )  # fmt: skip
    try:
        with to_stderr(quiet=True):
            run_chain(asked, None if request["stage"] == "run" else request["stage"])
    except KeyboardInterrupt as error:
        return EXIT_INTERRUPTED, message_of(error)
    except Exception as error:  # noqa: BLE001 - a failed run is a line of the table
        return exit_code_of(error), message_of(error)
    return EXIT_DONE, ""


class LocalRuns:
    """Makes runs in so many processes, see `fragfield.studies.runner.Runs`.

    Parameters
    ----------
    size : int
        Processes; each is started with its first run.
    threads : int
        Threads of a run.
    task : callable
        What is done with a request, for tests.
    """

    def __init__(self, size: int, threads: int, task: Task = perform) -> None:
        self.size = size
        self._processes = [_Process(threads, task) for _ in range(size)]
        self._free: queue.SimpleQueue[_Process] = queue.SimpleQueue()
        for process in self._processes:
            self._free.put(process)

    def call(self, request: dict[str, Any]) -> tuple[int, str]:
        """Make one run in a free process; its exit code and why."""
        process = self._free.get()
        try:
            return process.call(request)
        finally:
            self._free.put(process)

    def interrupt(self) -> None:
        """End the runs at hand with their checkpoints, and start no other."""
        for process in self._processes:
            process.interrupt()

    def close(self) -> None:
        """End the processes."""
        for process in self._processes:
            process.close()


class _Process:
    """A process that stays; started again after a run that it did not survive.

    It has a session of its own, so that Ctrl-C reaches it by us alone: a second signal would break the checkpoint that
    the first one makes it write.
    """

    def __init__(self, threads: int, task: Task) -> None:
        self._threads, self._task = threads, task
        self._pool: ProcessPoolExecutor | None = None
        self._process: BaseProcess | None = None
        self._ended = False

    def call(self, request: dict[str, Any]) -> tuple[int, str]:
        try:
            pool = self._started()
            if pool is None:
                return EXIT_INTERRUPTED, "interrupted"
            return pool.submit(_perform, self._task, {**request, "threads": self._threads}).result()
        except BrokenProcessPool:
            self.close()
            code = (self._process.exitcode if self._process is not None else None) or EXIT_FAULT
            return code, _why_ended(code)

    def interrupt(self) -> None:
        with _starting:
            self._ended = True
            if self._pool is not None and self._process is not None and self._process.is_alive():
                self._process.terminate()

    def close(self) -> None:
        pool, self._pool = self._pool, None
        if pool is not None:
            pool.shutdown()

    def _started(self) -> ProcessPoolExecutor | None:
        with _starting:
            if self._ended:
                return None
            if self._pool is None:
                context = multiprocessing.get_context("spawn")
                self._pool = ProcessPoolExecutor(1, context, _prepare, (self._threads, os.getpid()))
                known = set(multiprocessing.active_children())
                with _without_main():
                    self._pool.submit(os.getpid)
                self._process = next(one for one in multiprocessing.active_children() if one not in known)
            return self._pool


@contextmanager
def _without_main() -> Iterator[None]:
    """Start processes that do not run the caller's script again, as Python's would, to know its functions."""
    main = sys.modules["__main__"]
    sys.modules["__main__"] = ModuleType("__main__")
    try:
        yield
    finally:
        sys.modules["__main__"] = main


def _why_ended(code: int) -> str:
    if code < 0:
        return f"ended by signal {-code}"
    return "a fault of the program; its traceback is in the run's log" if code == EXIT_FAULT else f"exit code {code}"


def _prepare(threads: int, parent: int) -> None:
    """In a new process: a session of its own, its threads, and an end with the process that gives the work."""
    os.setsid()
    settle_child(InputError)
    os.environ["NUMBA_NUM_THREADS"] = os.environ["OMP_NUM_THREADS"] = str(threads)  # read when numba is loaded
    os.dup2(2, 1)  # what a library prints is no result of the command
    signal.signal(signal.SIGTERM, _interrupt)
    threading.Thread(target=_watch, args=(parent,), daemon=True).start()


def _perform(task: Task, request: dict[str, Any]) -> tuple[int, str]:
    _working.set()
    try:
        return task(request)
    finally:
        _working.clear()


def _interrupt(number: int, frame: FrameType | None) -> None:
    del number, frame
    if not _working.is_set():
        os._exit(EXIT_INTERRUPTED)
    raise KeyboardInterrupt


def _watch(parent: int) -> None:
    """End the run at hand, with its checkpoint, and the process once the one that gives the work is no more."""
    while os.getppid() == parent:
        time.sleep(_WATCH)
    os.kill(os.getpid(), signal.SIGTERM)
    while _working.is_set():
        time.sleep(_WATCH)
    os._exit(EXIT_INTERRUPTED)
