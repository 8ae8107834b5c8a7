"""Kernels compiled side by side, by processes that fill the cache.

Numba compiles on one thread of a process at a time, and its cache takes one writer for each function. So each kernel
of the list is given to one process, the longest first. A kernel that no process has compiled is compiled where it is
called, as without them.
"""

from __future__ import annotations

import json
import logging
import os
import selectors
import subprocess
import sys
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

from fragfield_base.compile_worker import NOT_KEPT

if TYPE_CHECKING:
    from collections.abc import Callable, Sequence

__all__ = ["compile_side_by_side"]

_log = logging.getLogger("fragfield.kernels")
_SCRIPT = Path(__file__).with_name("compile_worker.py")
_LAUNCHERS = ("OMPI_", "PMI_", "PMIX_", "SLURM_", "PRTE_", "MPI_")
_MOST = 8  # each takes up to 0.6 GB, and the longest kernel takes as long as an eighth of all


def compile_side_by_side(kernels: Sequence[dict[str, Any]], cores: int, done: Callable[[int], object]) -> int:
    """Compile kernels into the cache.

    Parameters
    ----------
    kernels : sequence of dict
        As in a list, each kernel once.
    cores : int
        Processes at most.
    done : callable
        Called with the number of kernels that are finished; what it raises ends the processes.

    Returns
    -------
    int
        How many kernels were compiled, or found in the cache. Where that cannot be written, all stop at once.
    """
    waiting = sorted(kernels, key=lambda kernel: float(kernel["seconds"]))
    workers = [worker for _ in range(min(cores, len(waiting), _MOST)) if (worker := _start()) is not None]
    finished = compiled = 0
    with selectors.DefaultSelector() as selector:
        try:
            for worker in workers:
                assert worker.stdout is not None
                if waiting and _hand_over(worker, waiting):
                    selector.register(worker.stdout, selectors.EVENT_READ, worker)
            while selector.get_map():
                for key, _ in selector.select():
                    answer = key.fileobj.readline()  # type: ignore[union-attr]
                    finished += 1
                    compiled += answer == "\n"
                    if answer != "\n":
                        _log.debug("a kernel was not compiled ahead: %s", answer.strip() or "its process ended")
                    done(finished)
                    if answer.startswith(NOT_KEPT):
                        return compiled
                    if not answer or not waiting or not _hand_over(key.data, waiting):
                        selector.unregister(key.fileobj)
        finally:
            for worker in workers:
                _end(worker)
    return compiled


def _start() -> subprocess.Popen[str] | None:
    # A launcher's variables would make MPI start in the child; its threads have nothing to do.
    environment = {key: value for key, value in os.environ.items() if not key.startswith(_LAUNCHERS)}
    try:
        worker = subprocess.Popen(
            [sys.executable, "-P", str(_SCRIPT)], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL, env=environment, text=True, encoding="utf-8",
        )  # fmt: skip
    except OSError as error:
        _log.debug("no process to compile kernels: %s", error)
        return None
    _send(worker.stdin, {"path": sys.path})
    return worker


def _hand_over(worker: subprocess.Popen[str], waiting: list[dict[str, Any]]) -> bool:
    """Give the longest kernel that waits to a worker; whether it took it."""
    if not _send(worker.stdin, waiting[-1]):
        return False
    waiting.pop()
    return True


def _send(stream: IO[str] | None, item: dict[str, Any]) -> bool:
    assert stream is not None
    try:
        stream.write(json.dumps(item) + "\n")
        stream.flush()
    except OSError:  # it has ended
        return False
    return True


def _end(worker: subprocess.Popen[str]) -> None:
    """End a worker that has nothing to do, or whose work is not needed any more."""
    worker.kill()
    worker.communicate()
