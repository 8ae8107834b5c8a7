"""One writer at a time in a folder, by a lock that ends with its process."""

from __future__ import annotations

import errno
import fcntl
import logging
import os
import re
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["has_locks", "locked"]

_log = logging.getLogger("fragfield.lock")


@contextmanager
def locked(folder: Path, error: type[Exception], *, warn: bool = True) -> Iterator[None]:
    """Hold a folder; raises `error` where another process holds it.

    The folder itself is locked (flock): no file is left behind, and the kernel gives the lock back when the process is
    gone, killed or not. A file system without such locks (some network ones) is used without one, with a warning unless
    `warn` is False: the caller says it.
    """
    try:
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as found:
        raise error(f"{folder}: cannot be locked ({found.strerror})") from None
    try:
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as found:
            if found.errno in (errno.EWOULDBLOCK, errno.EACCES):
                raise error(
                    f"{folder}: another command{_holder(descriptor)} is writing into it; wait for it to end, or use "
                    "another --out"
                ) from None
            if warn:
                _log.warning("%s: this file system has no locks; start no second run in it", folder)
        yield
    finally:
        os.close(descriptor)


def has_locks(folder: Path) -> bool:
    """Whether the file system of a folder has such locks; the folder may be held."""
    descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    try:
        fcntl.flock(descriptor, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except OSError as found:
        return found.errno in (errno.EWOULDBLOCK, errno.EACCES)
    finally:
        os.close(descriptor)
    return True


def _holder(descriptor: int) -> str:
    """' (process N)' where Linux says who holds the lock."""
    inode = os.fstat(descriptor).st_ino
    with suppress(OSError):
        for line in Path("/proc/locks").read_text(encoding="ascii", errors="replace").splitlines():
            if found := re.search(rf"FLOCK .* (\d+) [0-9a-f]+:[0-9a-f]+:{inode} ", line):
                return f" (process {found[1]})"
    return ""
