"""The journal of a growing HDF5 file: after any end of the writer, a write is complete or absent.

A write puts its new bytes behind the old ones, and the pages that change in the old part through the journal:

1. journal "undo" with the old size and seal; 2. new bytes behind the old; 3. journal "redo" with the changed pages;
4. pages, new seal; 5. no journal.

Whoever opens the file after a crash finds the journal and goes back (undo) or to the end (redo).
"""

from __future__ import annotations

import fcntl
import hashlib
import os
import struct
import time
from contextlib import suppress
from typing import TYPE_CHECKING

from fragfield_base.hdf5_body import write_at
from fragfield_base.seal import BLOCK, Seal
from fragfield_base.writing import described, publish

if TYPE_CHECKING:
    from pathlib import Path

    from fragfield_base.hdf5_body import Body

__all__ = ["JOURNAL", "begin", "commit", "journal_path", "recover", "replay"]

JOURNAL = ".journal"
"""Suffix of the journal of a file that grows."""

_MARK = b"fragfield journal 1"
_HEAD = struct.Struct("<4sQQ")  # "undo" or "redo", size, length of what follows
_ENTRY = struct.Struct("<QQ")  # offset and length of a changed page
_PATIENCE = 30.0  # s for which a reader waits for a write that is under way


def journal_path(path: Path) -> Path:
    """Where the journal of a file lies."""
    return path.with_name(path.name + JOURNAL)


def begin(path: Path, base: int, seal: Seal | None) -> int:
    """Step 1: from now on a write that is cut off is undone; returns the descriptor that locks the journal.

    Parameters
    ----------
    path : Path
        The file.
    base : int
        Its size (bytes) without its seal.
    seal : Seal, optional
        Its seal, where it has one.
    """
    return _write_journal(path, b"undo", base, seal.to_bytes() if seal is not None else b"")


def commit(path: Path, descriptor: int, body: Body, seal: Seal | None, locks: list[int]) -> None:
    """Steps 3 to 5: make the changes of `body` last; `locks` gets the descriptor that locks the new journal."""
    sealing = Seal(0, []) if seal is None else Seal(seal.size, list(seal.digests))
    room = len(Seal(body.size, [b"\0" * 16] * -(-body.size // BLOCK)).to_bytes())
    write_at(descriptor, body.size, bytes(room))  # now, while there is a way back: the seal will need it
    os.fsync(descriptor)
    pages = b"".join(_ENTRY.pack(offset, len(page)) + page for offset, page in body.changed_pages() if page)
    locks.append(_write_journal(path, b"redo", body.size, pages))
    _apply(descriptor, body.size, pages)
    sealing.renew(descriptor, body.size, body.changed)
    write_at(descriptor, body.size, sealing.to_bytes())
    os.fsync(descriptor)
    journal_path(path).unlink()


def _apply(descriptor: int, size: int, pages: bytes) -> None:
    start = 0
    while start < len(pages):
        offset, length = _ENTRY.unpack_from(pages, start)
        start += _ENTRY.size
        write_at(descriptor, offset, pages[start : start + length])
        start += length
    os.ftruncate(descriptor, size)


def _write_journal(path: Path, kind: bytes, size: int, content: bytes) -> int:
    """Put a journal in place, in one move; returns its descriptor, locked for as long as the writer lives."""
    journal = journal_path(path)
    draft = journal.with_name(journal.name + ".new")
    draft.unlink(missing_ok=True)
    descriptor = os.open(draft, os.O_RDWR | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC, 0o666)
    try:
        _lock(descriptor)
        text = _HEAD.pack(kind, size, len(content)) + content
        write_at(descriptor, 0, _MARK + hashlib.blake2b(text, digest_size=32).digest() + text)
        publish(draft, journal, descriptor)
    except BaseException:
        os.close(descriptor)
        with suppress(OSError):
            draft.unlink(missing_ok=True)
        raise
    return descriptor


def _lock(descriptor: int) -> bool:
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # a file system without locks
        return True
    return True


def recover(path: Path, error: type[Exception]) -> None:
    """Bring a file to where the last whole write left it, if a write was cut off.

    Raises
    ------
    error
        Another process is writing the file for longer than half a minute, or the file cannot be written.
    """
    journal = journal_path(path)
    until = time.monotonic() + _PATIENCE
    while journal.is_symlink() or journal.is_file():
        try:
            lock = os.open(journal, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
        except FileNotFoundError:
            return
        except OSError as found:
            raise error(described(path, found, "a write of it was cut off, and its journal is there")) from None
        try:
            if _lock(lock):
                _recover(path, error)
                return
        finally:
            os.close(lock)
        if time.monotonic() > until:
            raise error(f"{path}: another process is writing it; wait for it to end")
        time.sleep(0.02)


def _recover(path: Path, error: type[Exception]) -> None:
    try:
        descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
        try:
            replay(path, descriptor)
        finally:
            os.close(descriptor)
    except OSError as found:
        raise error(described(path, found, "a write of it was cut off, and its journal is there")) from None


def replay(path: Path, descriptor: int) -> None:
    """Do what the journal says and remove it; one that is not whole is only removed. Raises OSError."""
    journal = journal_path(path)
    held = os.fstat(descriptor).st_size
    try:
        # No journal of ours is larger: a page at most for a page of the file, each with its entry, or the seal.
        small = journal.stat().st_size <= held + held // 128 + BLOCK
        data = journal.read_bytes() if small else b""
    except FileNotFoundError:
        return
    found = _journal_of(data, held)
    if found is not None:
        kind, size, content = found
        if kind == b"undo":
            os.ftruncate(descriptor, size)
            write_at(descriptor, size, content)
        else:
            _apply(descriptor, size, content)
            write_at(descriptor, size, Seal.of(descriptor, size).to_bytes())
        os.fsync(descriptor)
    journal.unlink()


def _journal_of(data: bytes, held: int) -> tuple[bytes, int, bytes] | None:
    """Kind, size and content of a journal; None for one that is not whole, or not of a file of `held` bytes.

    A run directory may be of unknown origin, its journal with it: what it says is done only where a journal of this
    program could have said it. Both kinds are written when the file has at least the bytes that they leave it.
    """
    start = len(_MARK) + 32
    text = data[start:]
    if data[: len(_MARK)] != _MARK or hashlib.blake2b(text, digest_size=32).digest() != data[len(_MARK) : start]:
        return None
    if len(text) < _HEAD.size:
        return None
    kind, size, length = _HEAD.unpack_from(text)
    content = text[_HEAD.size :]
    if kind not in (b"undo", b"redo") or size > held or length != len(content):
        return None
    position = 0
    while kind == b"redo" and position < length:
        if position + _ENTRY.size > length:
            return None
        offset, count = _ENTRY.unpack_from(content, position)
        position += _ENTRY.size + count
        if offset + count > held or position > length:
            return None
    return kind, size, content
