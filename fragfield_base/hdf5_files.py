"""HDF5 files, written whole or added to in one move, and read after a look at their seal.

The HDF5 library never meets the disk while it writes. It writes to a `_Body`, which passes the bytes on and keeps the
first OSError to itself: HDF5 does not recover from a failed write (a full disk ends it by signal 11, now or when the
process exits), but it can always write to a `_Body`, and the error is raised afterwards, once.

A new file is a draft that is renamed. A file that grows (`appending`) gets its new bytes behind the old ones, and the
pages that change in the old part through a journal beside it:

1. journal "undo" with the old size and seal; 2. new bytes behind the old; 3. journal "redo" with the changed pages;
4. pages, new seal; 5. no journal.

Whoever opens the file after a crash finds the journal and goes back (undo) or to the end (redo).
"""

from __future__ import annotations

import atexit
import fcntl
import hashlib
import io
import os
import stat
import struct
import subprocess
import sys
import time
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield_base.interruption import Interruption
from fragfield_base.seal import BLOCK, Seal, SealError, read_seal
from fragfield_base.writing import described, open_draft, publish, refuse_link

if TYPE_CHECKING:
    from collections.abc import Iterator

    import h5py

__all__ = ["JOURNAL", "appending", "creating", "reading", "recover"]

JOURNAL = ".journal"
"""Suffix of the journal of a file that grows."""

# Version 1.8 holds attributes above 64 kB (the case of a large stack), and unlike later ones has no mark "open for
# writing", which would make the file of a killed run unreadable.
_VERSIONS = ("v108", "v110")
_PAGE = 4096
_MARK = b"fragfield journal 1"
_HEAD = struct.Struct("<4sQQ")  # "undo" or "redo", size, length of what follows
_ENTRY = struct.Struct("<QQ")  # offset and length of a changed page
_PATIENCE = 30.0  # s for which a reader waits for a write that is under way
_KEPT = "what was written before is unchanged and can be read"
_LAUNCHERS = ("OMPI_", "PMI_", "PMIX_", "SLURM_", "PRTE_", "MPI_")
_READING_FAULTS = (
    OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError, MemoryError,
)  # fmt: skip
_sound: dict[str, tuple[int, int, int]] = {}  # files whose seal this process has checked, as they were then


class _Body(io.RawIOBase):
    """A file as h5py's driver for Python objects uses it: no method raises, the first fault is kept.

    Bytes below `base` are not touched on the disk: changed pages of theirs are kept in `pages`.
    """

    def __init__(self, descriptor: int, base: int) -> None:
        super().__init__()
        self._descriptor = descriptor
        self._base = base
        self._at = 0
        self.size = base
        self.pages: dict[int, bytearray] = {}
        self.changed: set[int] = set()
        self.fault: OSError | None = None

    def readable(self) -> bool:
        return True

    def writable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self.size}[whence]
        self._at = start + offset
        return self._at

    def tell(self) -> int:
        return self._at

    def readinto(self, buffer: Any) -> int:  # noqa: ANN401 - any buffer
        view = memoryview(buffer).cast("B")
        view[:] = self._bytes(self._at, len(view))
        self._at += len(view)
        return len(view)

    def write(self, data: Any) -> int:  # noqa: ANN401 - any buffer
        view = memoryview(data).cast("B")
        start, end = self._at, self._at + len(view)
        below = min(max(self._base - start, 0), len(view))
        for offset in range(start - start % _PAGE, start + below, _PAGE) if below else ():
            page = self._page(offset)
            first, last = max(offset, start), min(offset + _PAGE, start + below)
            page[first - offset : last - offset] = view[first - start : last - start]
        if below < len(view):
            self._put(start + below, view[below:])
        if len(view):
            self.changed.update(range(start // BLOCK, (end - 1) // BLOCK + 1))
        self.size = max(self.size, end)
        self._at = end
        return len(view)

    def truncate(self, size: int | None = None) -> int:
        size = self._at if size is None else size
        if size < self.size:
            self.changed.add(max(size - 1, 0) // BLOCK)
        elif size > self.size:
            self.changed.update(range(self.size // BLOCK, size // BLOCK + 1))
        self.size = size
        return size

    def flush(self) -> None:
        """Nothing is held back but the pages, which wait for the journal."""

    def changed_pages(self) -> Iterator[tuple[int, bytes]]:
        """Offsets and contents of the changed pages, as far as they lie in the old part."""
        for offset, page in sorted(self.pages.items()):
            yield offset, bytes(page[: max(min(self._base, self.size) - offset, 0)])

    def _page(self, offset: int) -> bytearray:
        if offset not in self.pages:
            self.pages[offset] = bytearray(self._get(offset, min(_PAGE, self._base - offset)).ljust(_PAGE, b"\0"))
        return self.pages[offset]

    def _get(self, offset: int, length: int) -> bytes:
        try:
            return os.pread(self._descriptor, length, offset)
        except OSError as error:
            self._keep(error)
            return b""

    def _put(self, offset: int, data: memoryview) -> None:
        if self.fault is not None:
            return
        try:
            write_at(self._descriptor, offset, data)
        except OSError as error:
            self._keep(error)

    def _keep(self, error: OSError) -> None:
        # Without its traceback, whose frames hold the library's property list, which holds this object: nothing would
        # close the list before the library does, after the interpreter has gone, by signal 11.
        self.fault = self.fault or error.with_traceback(None)

    def _bytes(self, start: int, length: int) -> bytes:
        found = bytearray(length)
        data = self._get(start, min(length, max(self.size - start, 0)))
        found[: len(data)] = data
        for offset in range(start - start % _PAGE, start + length, _PAGE) if self.pages else ():
            if (page := self.pages.get(offset)) is not None:
                first, last = max(offset, start), min(offset + _PAGE, start + length, self._base)
                if last > first:
                    found[first - start : last - start] = page[first - offset : last - offset]
        return bytes(found)


def write_at(descriptor: int, offset: int, data: bytes | memoryview) -> None:
    """Write all of `data` at an offset; raises OSError."""
    view = memoryview(data)
    while view:
        written = os.pwrite(descriptor, view[: 1 << 30], offset)
        offset, view = offset + written, view[written:]


_open: dict[int, h5py.File] = {}


@contextmanager
def _closed_at_exit(file: h5py.File) -> Iterator[h5py.File]:
    """Close a file when the block ends, or, where it never does, while Python is still there to be written through."""
    _open[id(file)] = file
    try:
        with file:
            yield file
    finally:
        del _open[id(file)]


@atexit.register
def _close_all() -> None:
    for file in list(_open.values()):
        with suppress(Exception):
            file.close()


@contextmanager
def creating(path: Path, error: type[Exception], **options: Any) -> Iterator[h5py.File]:
    """Write a new HDF5 file; it takes its name, sealed, when the block ends without an error.

    Parameters
    ----------
    path : Path
        The file; an older one is replaced.
    error : type
        Raised, with one message, where it cannot be written.
    options
        Of h5py.File.
    """
    import h5py

    options.setdefault("libver", _VERSIONS)
    with Interruption(patient=True):
        draft, descriptor = open_draft(path, error)
        body = _Body(descriptor, 0)
        try:
            with _closed_at_exit(h5py.File(body, "w", **options)) as file:
                yield file
            _raise(body)
            os.ftruncate(descriptor, body.size)
            write_at(descriptor, body.size, Seal.of(descriptor, body.size).to_bytes())
            path.with_name(path.name + JOURNAL).unlink(missing_ok=True)  # of an older file of this name
            publish(draft, path, descriptor)
        except BaseException as found:
            with suppress(OSError):
                draft.unlink(missing_ok=True)
            fault = body.fault or found  # HDF5 may have stumbled over what the disk did not give
            if isinstance(fault, OSError):
                raise error(described(path, fault)) from None
            raise
        finally:
            os.close(descriptor)


@contextmanager
def appending(path: Path, error: type[Exception], **options: Any) -> Iterator[h5py.File]:
    """Add to an HDF5 file or change it; the file has all changes when the block ends without an error, else none.

    Parameters
    ----------
    path : Path
        The file, which exists.
    error : type
        Raised, with one message, where it cannot be read or written.
    options
        Of h5py.File.
    """
    import h5py

    refuse_link(path, error)
    options.setdefault("libver", _VERSIONS)
    with Interruption(patient=True):
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
        except OSError as found:
            raise error(described(path, found, _KEPT)) from None
        locks: list[int] = []
        body: _Body | None = None
        try:
            recover(path, error)
            seal = read_seal(descriptor)
            base = os.fstat(descriptor).st_size if seal is None else seal.size
            locks.append(_write_journal(path, b"undo", base, seal.to_bytes() if seal is not None else b""))
            body = _Body(descriptor, base)
            with _closed_at_exit(h5py.File(body, "r+", **options)) as file:
                yield file
            _raise(body)
            _commit(path, descriptor, body, seal, locks)
        except BaseException as found:
            if locks:
                with suppress(OSError):
                    _replay(path, descriptor)
            fault = (body.fault if body is not None else None) or found
            if isinstance(fault, OSError):
                raise error(described(path, fault, _KEPT)) from None
            if isinstance(fault, SealError):
                raise error(f"{path}: damaged: {fault}") from None
            raise
        finally:
            os.close(descriptor)
            for lock in locks:
                os.close(lock)


def _commit(path: Path, descriptor: int, body: _Body, seal: Seal | None, locks: list[int]) -> None:
    """Make the changes of `body` last; `locks` gets the descriptor that locks the new journal."""
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
    path.with_name(path.name + JOURNAL).unlink()


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
    journal = path.with_name(path.name + JOURNAL)
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
    journal = path.with_name(path.name + JOURNAL)
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
            _replay(path, descriptor)
        finally:
            os.close(descriptor)
    except OSError as found:
        raise error(described(path, found, "a write of it was cut off, and its journal is there")) from None


def _replay(path: Path, descriptor: int) -> None:
    """Do what the journal says and remove it; one that is not whole is only removed. Raises OSError."""
    journal = path.with_name(path.name + JOURNAL)
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

    A run directory may come from elsewhere, its journal with it: what it says is done only where a journal of this
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
    place = 0
    while kind == b"redo" and place < length:
        if place + _ENTRY.size > length:
            return None
        offset, count = _ENTRY.unpack_from(content, place)
        place += _ENTRY.size + count
        if offset + count > held or place > length:
            return None
    return kind, size, content


def _raise(body: _Body) -> None:
    if body.fault is not None:
        raise body.fault


@contextmanager
def reading(path: Path, error: type[Exception], advice: str = "") -> Iterator[h5py.File]:
    """Open an HDF5 file that may be damaged, or come from elsewhere; every fault ends in one message.

    A seal is checked before HDF5 sees the file. A file without one is looked at by another process first, which may
    fail as it likes (`fragfield_base.probe`).

    Parameters
    ----------
    path : Path
        The file.
    error : type
        Raised for a file that is missing, damaged, larger than memory, or in which the block does not find what it
        looks for. Errors of this class pass as they are.
    advice : str
        What to do then; the end of the message.
    """
    import h5py

    check_sound(path, error, advice)
    end = f"; {advice}" if advice else ""
    try:
        file = h5py.File(path, "r")
    except _READING_FAULTS as found:
        raise error(f"{path}: cut off, or not an HDF5 file ({found}){end}") from None
    with file:
        try:
            yield file
        except error:
            raise
        except _READING_FAULTS as found:
            if type(found).__module__.partition(".")[0] not in ("builtins", "h5py", "numpy"):
                raise  # an error of a package of ours, with a message of its own
            raise error(f"{path}: data cut off or damaged ({_short(found)}){end}") from None


def check_sound(path: Path, error: type[Exception], advice: str = "") -> None:
    """Refuse a file that is missing, no regular file, or not as it was sealed; `error` with one message."""
    end = f"; {advice}" if advice else ""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise error(f"{path}: not a file")
        recover(path, error)
        before = _state(path)
        if _sound.get(str(path)) == before:
            return
        fault = _fault_of(path)
        if fault is not None and _state(path) != before:  # it has just been written
            time.sleep(0.5)
            fault = _fault_of(path)
    except FileNotFoundError:
        raise error(f"{path}: no such file{end}") from None
    except OSError as found:
        raise error(f"{path}: cannot be read ({found.strerror or found}){end}") from None
    if fault is not None:
        raise error(f"{path}: {fault}{end}")
    _sound[str(path)] = before


def _state(path: Path) -> tuple[int, int, int]:
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns


def _fault_of(path: Path) -> str | None:
    descriptor = os.open(path, os.O_RDONLY | os.O_CLOEXEC)
    try:
        seal = read_seal(descriptor)
        if seal is None:
            return _probed(path)
        seal.check(descriptor)
    except SealError as found:
        return f"damaged, cut off or changed since it was written: {found}"
    finally:
        os.close(descriptor)
    return None


def _probed(path: Path) -> str | None:
    """Have a process of its own look through a file that is not sealed; what is wrong with it."""
    # A launcher's variables would make MPI start in the child.
    environment = {key: value for key, value in os.environ.items() if not key.startswith(_LAUNCHERS)}
    command = [sys.executable, "-s", "-P", str(Path(__file__).with_name("probe.py")), str(path)]
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=60, env=environment, check=False)
    except subprocess.TimeoutExpired:
        return "cut off, or not an HDF5 file that can be read in a minute"
    if done.returncode == 0:
        return None
    words = done.stdout.strip().splitlines()
    return words[-1] if done.returncode == 1 and words else "cut off, or not an HDF5 file (reading it crashed)"


def _short(error: BaseException) -> str:
    text = " ".join((str(error) or type(error).__name__).split())
    return text if len(text) <= 200 else text[:197] + "..."
