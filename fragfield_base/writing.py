"""Writes every output file: under a temporary name, flushed to disk, then renamed atomically.

A reader, another process and a run that is killed therefore see the old file or the new one, never a part of it. No
file is written through a symbolic link: a link planted under an expected name would redirect the output elsewhere.
Texts that users chose are no formulas in tables.
"""

from __future__ import annotations

import csv
import errno
import fcntl
import io
import logging
import os
import stat
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO

DRAFT = ".part"
"""Suffix of a file while it is written."""

_FORMULA = ("=", "+", "-", "@", "\t", "\r")
_QUOTED = (",", '"', "\n", "\r")
_AGAIN = "make room or name a folder that is writable, then run the command again (a burst: with --resume)"


def described(path: Path, error: OSError, kept: str = "what stood there before is unchanged") -> str:
    """One message for a file that could not be written: the reason, what was kept, and how to go on."""
    return f"{path}: cannot be written: {error.strerror or error}; {kept}; {_AGAIN}"


def refuse_link(path: Path, error: type[Exception]) -> None:
    """Refuse a path that is a symbolic link or anything but a regular file; one that does not exist is fine."""
    try:
        mode = path.lstat().st_mode
    except OSError:
        return
    if stat.S_ISLNK(mode):
        raise error(f"{path}: is a symbolic link, and this program writes through none; remove it")
    if not stat.S_ISREG(mode):
        raise error(f"{path}: is not a regular file; remove it")


@contextmanager
def replacing(path: Path, error: type[Exception], *, durable: bool = True) -> Iterator[BinaryIO]:
    """Open a file to be written whole; it replaces an older one when the block ends without an error.

    Raises `error`, with one message, for every OSError. `durable`: the folder is flushed as well, so that the new file
    is there after the machine has failed, not the older one.
    """
    refuse_link(path, error)
    draft = path.with_name(path.name + DRAFT)
    refuse_link(draft, error)
    try:
        draft.unlink(missing_ok=True)  # of a run that was killed
        # Exclusive: a link planted in between is not followed but ends in an error.
        flags = os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        stream = os.fdopen(os.open(draft, flags, 0o666), "w+b")
    except OSError as found:
        raise error(described(path, found)) from None
    try:
        with stream:
            yield stream
            stream.flush()
            os.fsync(stream.fileno())
            draft.replace(path)
            if durable:
                flush_folder(path.parent)
    except BaseException as found:
        with suppress(OSError):
            draft.unlink(missing_ok=True)
        with suppress(OSError):
            stream.close()
        if isinstance(found, OSError):
            raise error(described(path, found)) from None
        raise


def write_text(path: Path, text: str, error: type[Exception]) -> Path:
    """Write a text file in UTF-8, whole or not at all; returns its path."""
    return write_bytes(path, text.encode("utf-8"), error)


def write_bytes(path: Path, data: bytes, error: type[Exception]) -> Path:
    """Write a file, whole or not at all; returns its path."""
    with replacing(path, error) as stream:
        stream.write(data)
    return path


def write_files(files: Mapping[Path, bytes], error: type[Exception]) -> None:
    """Write files, each whole or not at all, and flush each folder once, after the last of them."""
    for path, data in files.items():
        with replacing(path, error, durable=False) as stream:
            stream.write(data)
    for folder in {path.parent for path in files}:
        flush_folder(folder)


def append_text_file(path: Path, error: type[Exception], *, fresh: bool) -> int:
    """Descriptor of a text file that grows, such as a log: emptied where `fresh`, never through a symbolic link."""
    refuse_link(path, error)
    flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW | os.O_CLOEXEC | (os.O_TRUNC if fresh else 0)
    try:
        return os.open(path, flags, 0o666)
    except OSError as found:
        raise error(described(path, found)) from None


def flush_folder(folder: Path) -> None:
    """Make a rename durable, where the file system can."""
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def harmless(text: str) -> str:
    """The text, behind an apostrophe where a spreadsheet would compute what it says (`=cmd|...`)."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def csv_table(rows: Iterable[Iterable[object]]) -> str:
    """Text of a CSV file, its texts harmless; None is an empty cell."""
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerows([harmless(cell) if isinstance(cell, str) else cell for cell in row] for row in rows)
    return text.getvalue()


def csv_cell(text: str) -> str:
    """One cell after RFC 4180: in quotes, with quotes doubled, where it holds a comma, a quote or a new line."""
    text = harmless(text)
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in _QUOTED) else text


_log = logging.getLogger("fragfield.lock")


@contextmanager
def locked(folder: Path, error: type[Exception]) -> Iterator[None]:
    """Hold a folder; raises `error` where another process holds it.

    The folder itself is locked (flock): no file is left behind, and the kernel gives the lock back when the process is
    gone, killed or not. A file system without such locks (some network ones) is used without one, with a warning.
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
                    f"{folder}: another command is writing into it; wait for it to end, or use another --out"
                ) from None
            _log.warning("%s: this file system has no locks; start no second run in it", folder)
        yield
    finally:
        os.close(descriptor)
