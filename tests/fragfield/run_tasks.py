"""Runs of a study by made-up laws: in threads of this process, or as functions that a new process can import."""

from __future__ import annotations

import os
import time
from concurrent.futures import ThreadPoolExecutor

from fragfield.studies.workers import Outcome

__all__ = ["Threads", "answer", "in_threads", "wait_for_interruption"]


class Threads:
    """Workers of this process, which call a function of a task; see `fragfield.studies.workers.Workers`."""

    def __init__(self, size, function):
        self.size, self._function = size, function
        self._pool = ThreadPoolExecutor(size)

    def submit(self, task):
        """Begin a run."""
        return self._pool.submit(self._function, task)

    def interrupt(self):
        """Begin no other."""
        self._pool.shutdown(wait=False, cancel_futures=True)

    def close(self):
        """Wait for the runs at hand."""
        self._pool.shutdown()


def in_threads(monkeypatch, function):
    """Let every study call a function of its tasks in threads of this process."""

    def workers(scheduler, most, *, jobs, threads):
        return Threads(min(jobs or 2, most), function)

    monkeypatch.setattr("fragfield.studies.study.workers_of", workers)


def answer(task):
    """Print as C code does, then end the process as the values say, or answer with its number and its threads."""
    os.write(1, b"words\n")
    if "signal" in task.values:
        os.kill(os.getpid(), task.values["signal"])
    if "exit" in task.values:
        os._exit(task.values["exit"])
    return Outcome(0, "", {"process": os.getpid(), "threads": os.environ["NUMBA_NUM_THREADS"]})


def wait_for_interruption(task):
    """Wait, as a burst that writes a checkpoint in its own time when it is interrupted."""
    out = task.directory
    try:
        out.with_suffix(".begun").touch()
        time.sleep(60)
    except KeyboardInterrupt:
        time.sleep(0.5)
        out.with_suffix(".checkpoint").touch()
        return Outcome(130, "interrupted")
    return Outcome(0, "", {})
