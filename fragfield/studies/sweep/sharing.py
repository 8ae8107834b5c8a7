"""Distributes runs over workers as they become free: local processes, or those of a cluster."""

from __future__ import annotations

import queue
import threading
from contextlib import suppress
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["AnyWorker", "share_out"]

_WAIT = 0.2  # s; a wait without end would not see Ctrl-C on every system

Outcome = TypeVar("Outcome")


class AnyWorker(Protocol):
    """What makes one run after another: `fragfield.studies.sweep.worker.Worker`, or one of a cluster."""

    def call(self, request: dict[str, Any]) -> tuple[int, str]:
        """Make one run; its exit code and why."""

    def interrupt(self) -> None:
        """End the run at hand with its checkpoint, and start no other."""

    def close(self) -> None:
        """Give back what the worker holds."""


def share_out(
    workers: Sequence[AnyWorker],
    numbers: Sequence[int],
    make: Callable[[int, AnyWorker], Outcome],
    ended: Callable[[int, Outcome], None],
) -> None:
    """Make the runs with these numbers, each by the next free worker, and report every end in this thread.

    Parameters
    ----------
    workers : sequence of AnyWorker
        They are closed at the end, and interrupted first where an error or Ctrl-C ends the work.
    numbers : sequence of int
        Runs, in the order in which they are begun.
    make : callable
        Makes a run with a worker, in a thread of that worker.
    ended : callable
        Called with a run's number and what `make` returned.

    Raises
    ------
    BaseException
        What `make` or `ended` raised; no further run is begun.
    """
    waiting: queue.SimpleQueue[int] = queue.SimpleQueue()
    for number in numbers:
        waiting.put(number)
    results: queue.SimpleQueue[tuple[int, Any, BaseException | None] | None] = queue.SimpleQueue()

    def work(worker: AnyWorker) -> None:
        while True:
            try:
                number = waiting.get_nowait()
            except queue.Empty:
                break
            try:
                results.put((number, make(number, worker), None))
            except BaseException as error:  # noqa: BLE001 - raised again where the results are awaited
                results.put((number, None, error))
                break
        results.put(None)

    threads = [threading.Thread(target=work, args=(worker,), daemon=True) for worker in workers]
    for thread in threads:
        thread.start()
    try:
        working = len(threads)
        while working:
            with suppress(queue.Empty):
                if (one := results.get(timeout=_WAIT)) is None:
                    working -= 1
                    continue
                number, outcome, error = one
                if error is not None:
                    raise error
                ended(number, outcome)
    except BaseException:
        for worker in workers:
            worker.interrupt()
        raise
    finally:
        for thread in threads:
            thread.join()
        for worker in workers:
            worker.close()
