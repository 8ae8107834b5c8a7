"""Faults on demand: system calls that fail, or end the process, at a chosen call."""

from __future__ import annotations

import errno
import os
import signal
import warnings
from contextlib import contextmanager
from typing import TYPE_CHECKING
from unittest import mock

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["CALLS", "at_every_call", "failing_call", "killed_at_call", "limited_file_size"]

CALLS = ("pwrite", "pread", "ftruncate", "fsync", "replace", "unlink", "open", "write")
"""What is counted: all calls of `os` by which files are written, renamed and read."""


@contextmanager
def _counted(act: Callable[[int, str], None], names: tuple[str, ...]) -> Iterator[list[str]]:
    """Call `act` with the number (from 0) and the name of every call; gives the names."""
    seen: list[str] = []

    def wrapped(name, real):
        def call(*arguments, **options):
            seen.append(name)
            act(len(seen) - 1, name)
            return real(*arguments, **options)

        return call

    patches = [mock.patch.object(os, name, wrapped(name, getattr(os, name))) for name in names]
    for patch in patches:
        patch.start()
    try:
        yield seen
    finally:
        for patch in reversed(patches):
            patch.stop()


@contextmanager
def failing_call(number: int, code: int = errno.ENOSPC, names: tuple[str, ...] = CALLS) -> Iterator[list[str]]:
    """Let the call of this number fail with an OSError, once."""

    def act(current, name):
        if current == number:
            raise OSError(code, os.strerror(code))

    with _counted(act, names) as seen:
        yield seen


@contextmanager
def killed_at_call(number: int, names: tuple[str, ...] = CALLS) -> Iterator[list[str]]:
    """End the process before the call of this number, by the signal that cannot be caught."""

    def act(current, name):
        if current == number:
            os.kill(os.getpid(), signal.SIGKILL)

    with _counted(act, names) as seen:
        yield seen


def at_every_call(work: Callable[[], None], prepare: Callable[[], None], check: Callable[[int], None]) -> int:
    """Kill a process that does `work` before each of its calls in turn; `check` what it leaves. Gives their number."""
    number = 0
    while True:
        prepare()
        with warnings.catch_warnings():  # other threads of this process wait: the child writes a file and ends
            warnings.filterwarnings("ignore", r".*multi-threaded, use of fork\(\)", DeprecationWarning)
            child = os.fork()
        if child == 0:
            try:
                with killed_at_call(number):
                    work()
            finally:
                os._exit(0)
        _, status = os.waitpid(child, 0)
        check(number)
        if not os.WIFSIGNALED(status):
            return number
        assert os.WTERMSIG(status) == signal.SIGKILL
        number += 1


@contextmanager
def limited_file_size(size: int) -> Iterator[None]:
    """No file may grow beyond `size` bytes: writes end in EFBIG, as they end in ENOSPC on a full disk."""
    import resource

    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    usual = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, before[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
        signal.signal(signal.SIGXFSZ, usual)
