"""Runs of a study, from a case to their numbers: in processes of this machine, or by the workers of a dask cluster.

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
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Future, ProcessPoolExecutor, wait
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from multiprocessing.connection import Connection
from pathlib import Path
from types import FrameType, ModuleType
from typing import Any

from fragfield.case import CaseTable
from fragfield.case.conversion.rounds import burst_rounds
from fragfield.case.load import case_from_document
from fragfield.case.problem import burst_settings
from fragfield.errors import EXIT_DONE, EXIT_FAULT, EXIT_INTERRUPTED, InputError, exit_code_of, message_of
from fragfield.files.provenance import revision
from fragfield.files.run_directory import RunDirectory
from fragfield.hazard.recommended import hazard_of, recommended_of
from fragfield.pipeline.beside import burst_beside, flown_beside
from fragfield.pipeline.chain import run_chain
from fragfield.pipeline.convergence import OF_A_SWEEP
from fragfield.pipeline.job import RunOptions
from fragfield.pipeline.parallel import Team
from fragfield.results.break_up import BreakUp
from fragfield.results.burst import Burst
from fragfield.results.convergence import Convergence
from fragfield.results.flight import Flight
from fragfield.results.part import to_json
from fragfield.results.summary import Summary
from fragfield.terminal.logs import to_stderr
from fragfield_base.ambient import leave_launch, settle
from fragfield_base.cores import cores
from fragfield_base.interruption import end_requested
from fragfield_base.version import __version__
from transition import Snapshot

_last: list[tuple[object, tuple[Burst, Snapshot]]] = []
"""What the last burst of this process was made of, and that burst: runs that differ in the break-up or the flight alone
have the same."""


@dataclass(frozen=True)
class Task:
    """A run to be made."""

    name: str
    """Of its row, and of its directory in the folder of the study."""
    case: CaseTable | Mapping[str, Any]
    """Resolved; or tables, which are resolved where the run is made."""
    results: Callable[[Summary], dict[str, Any]]
    """What is kept of its summary."""
    values: dict[str, Any] = field(default_factory=dict)
    """By dotted key what distinguishes it."""
    directory: Path | None = None
    """Run directory, which has been claimed: with the same case, what is done in it stays."""
    only: str | None = None
    """"burst", for the burst alone."""
    burst: Path | None = None
    """Run directory of a burst that is shared."""
    sample: bool = False
    """With exposed sites, and fewer points of an integral."""
    threads: int = 1


@dataclass(frozen=True)
class Outcome:
    """How a run ended."""

    code: int
    """Exit code."""
    message: str = ""
    """Why it failed, or why its distance is not determined."""
    results: dict[str, Any] | None = None

    @classmethod
    def of(cls, error: BaseException) -> Outcome:
        """That of a run which an error ended."""
        return cls(exit_code_of(error), message_of(error))


def perform(task: Task) -> Outcome:
    """Make a run in this process; what it logs and warns of stands in its run directory alone."""
    try:
        with to_stderr(quiet=True):
            if task.directory is not None:
                return _outcome(task, _in_directory(task, task.directory))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                return _outcome(task, _numbers(task))
    except KeyboardInterrupt as error:
        return Outcome.of(error)
    except Exception as error:  # noqa: BLE001 - a failed run is a row of the table
        return Outcome.of(error)


def _outcome(task: Task, summary: Summary) -> Outcome:
    reason = "" if summary.hazard is None or summary.hazard.determined else summary.hazard.reason
    return Outcome(EXIT_DONE, reason, to_json(task.results(summary)))


def _in_directory(task: Task, directory: Path) -> Summary:
    assert isinstance(task.case, CaseTable)
    options = RunOptions(directory, resume=True, quiet=True, threads=task.threads, lean=True, made=task.case)
    run_chain(options, task.only)
    return RunDirectory(directory).results()


def _numbers(task: Task) -> Summary:
    case = task.case
    if not isinstance(case, CaseTable):
        case = case_from_document(dict(case), source=task.name, folder=Path())
    summary, snapshot = _burst(case, task)
    if task.only == "burst":
        return Summary(burst=summary)
    if not task.sample:  # no row lists what surfaces and sites meet, and their crossings take a third of the flight
        case = case.model_copy(update={"witness": [], "exposed": []})
    began = time.perf_counter()
    flown, fragments = flown_beside(case, snapshot, task.threads, sample=task.sample)
    hazard = hazard_of(flown.hazard.headline)
    return Summary(
        burst=summary,
        break_up=BreakUp.known(fragments=fragments),
        flight=Flight.known(wall_seconds=time.perf_counter() - began),
        hazard=hazard if task.sample else recommended_of(hazard, Convergence(reason=OF_A_SWEEP)),
        exposed=tuple(flown.exposed),
    )


def _burst(case: CaseTable, task: Task) -> tuple[Burst, Snapshot]:
    """The burst's summary, and the state at its end: of a run directory, of the last run, or of one made now."""
    key: object = task.burst or (burst_rounds(case), burst_settings(case))
    if not (_last and _last[0][0] == key):
        _last.clear()  # before the next one is made: two of them may not fit into the memory
        if task.burst is not None:
            run = RunDirectory(task.burst)
            burst = run.results().burst
            assert burst is not None  # a run that is shared
            _last.append((key, (burst, Snapshot.read(run.file("burst_snapshot.h5")))))
        else:
            _last.append((key, burst_beside(case, Team())))
    return _last[0][1]


_WAIT = 0.2  # s; a wait without end would not see Ctrl-C on every system
_ANSWER = 20.0  # s for a scheduler to answer
_KILLED = "a process was killed, for want of memory or by a signal; --resume makes its runs again"
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

    Those whose process is killed have failed, with those beside them. `workers` is closed at the end, and interrupted
    first where an error or Ctrl-C ends the work.
    """
    waiting, at_hand = iter(tasks), dict[Future[Outcome], Task]()
    try:
        while True:
            while len(at_hand) < workers.size and (task := next(waiting, None)) is not None:
                begun(task)
                at_hand[workers.submit(task)] = task
            if not at_hand:
                return
            for future in wait(at_hand, timeout=_WAIT, return_when=FIRST_COMPLETED).done:
                error = future.exception()
                outcome = future.result() if error is None else Outcome.of(error)
                if isinstance(error, BrokenExecutor):
                    outcome = Outcome(EXIT_FAULT, _KILLED)
                if outcome.code == EXIT_INTERRUPTED:
                    raise KeyboardInterrupt
                ended(at_hand.pop(future), outcome)
                del future  # a cluster makes a run again whose result is held here and lost there
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
        with _without_main():
            try:
                return self._started().submit(_perform, self._function, task)
            except BrokenExecutor:  # a process was killed
                self.close()
                return self._started().submit(_perform, self._function, task)

    def _started(self) -> ProcessPoolExecutor:
        if self._pool is None:
            ready = (self._threads, self._held_there)
            self._pool = ProcessPoolExecutor(self.size, self._context, _prepare, ready)
        return self._pool

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
    leave_launch()
    settle(InputError)
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
