"""Files of unknown origin, read with a limit on size and no devices or pipes."""

from __future__ import annotations

import os
import stat
from pathlib import Path

MOST_TEXT = 1 << 31
"""Bytes of a table or map of heights; what is read needs several times as much memory."""


def read_text(path: Path, error: type[Exception], *, most: int = MOST_TEXT, advice: str = "") -> str:
    """Text of a UTF-8 file, a byte-order mark left out.

    Raises `error`, with one message that ends in `advice`, where it is missing, no regular file, larger than `most`
    bytes, or not UTF-8.
    """
    try:
        return read_bytes(path, error, most=most, advice=advice).decode("utf-8-sig")
    except UnicodeDecodeError as fault:
        end = f"; {advice}" if advice else ""
        raise error(f"{path}: not text in UTF-8 ({fault.reason} at byte {fault.start}){end}") from None


def read_bytes(path: Path, error: type[Exception], *, most: int = MOST_TEXT, advice: str = "") -> bytes:
    """Content of a regular file; parameters as of `read_text`."""
    end = f"; {advice}" if advice else ""
    try:
        # Not waiting: to open a pipe would last until somebody writes to it.
        descriptor = os.open(path, os.O_RDONLY | os.O_NONBLOCK | os.O_CLOEXEC)
        with os.fdopen(descriptor, "rb") as stream:
            found = os.fstat(descriptor)
            if stat.S_ISDIR(found.st_mode):
                raise error(f"{path}: a directory; a file is needed{end}")
            if not stat.S_ISREG(found.st_mode):
                raise error(f"{path}: not a regular file{end}")
            if found.st_size > most:
                raise error(f"{path}: {found.st_size} bytes; allowed: at most {most}{end}")
            return stream.read(most + 1)
    except FileNotFoundError:
        raise error(f"{path}: no such file{end}") from None
    except OSError as fault:
        raise error(f"{path}: cannot be read ({fault.strerror or fault}){end}") from None
