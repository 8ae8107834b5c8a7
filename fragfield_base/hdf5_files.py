"""HDF5 files: written whole or extended atomically, and read after a check of their seal.

The HDF5 library never meets the disk while it writes (`fragfield_base.hdf5_body`). A new file is a draft that is
renamed; a file that grows is changed by way of a journal (`fragfield_base.hdf5_journal`); a file that is read is
checked first (`fragfield_base.hdf5_soundness`).
"""

from __future__ import annotations

import atexit
import os
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any

from fragfield_base.hdf5_body import Body, write_at
from fragfield_base.hdf5_journal import JOURNAL, begin, commit, journal_path, recover, replay
from fragfield_base.hdf5_soundness import check_sound
from fragfield_base.interruption import Interruption
from fragfield_base.seal import Seal, SealError, read_seal
from fragfield_base.writing import described, open_draft, publish, refuse_link, refuse_second_name

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import h5py

__all__ = ["JOURNAL", "appending", "check_sound", "creating", "reading", "recover"]

# Version 1.8 holds attributes above 64 kB (the case of a large stack), and unlike later ones has no mark "open for
# writing", which would make the file of a killed run unreadable.
_VERSIONS = ("v108", "v110")
_KEPT = "what was written before is unchanged and can be read"
_READING_FAULTS = (
    OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError, MemoryError,
)  # fmt: skip
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
        body = Body(descriptor, 0)
        try:
            with _closed_at_exit(h5py.File(body, "w", **options)) as file:
                yield file
            body.raise_fault()
            os.ftruncate(descriptor, body.size)
            write_at(descriptor, body.size, Seal.of(descriptor, body.size).to_bytes())
            journal_path(path).unlink(missing_ok=True)  # of an older file of this name
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
    refuse_second_name(path, error)
    options.setdefault("libver", _VERSIONS)
    with Interruption(patient=True):
        try:
            descriptor = os.open(path, os.O_RDWR | os.O_NOFOLLOW | os.O_CLOEXEC)
        except OSError as found:
            raise error(described(path, found, _KEPT)) from None
        locks: list[int] = []
        body: Body | None = None
        try:
            recover(path, error)
            seal = read_seal(descriptor)
            base = os.fstat(descriptor).st_size if seal is None else seal.size
            locks.append(begin(path, base, seal))
            body = Body(descriptor, base)
            with _closed_at_exit(h5py.File(body, "r+", **options)) as file:
                yield file
            body.raise_fault()
            commit(path, descriptor, body, seal, locks)
        except BaseException as found:
            if locks:
                with suppress(OSError):
                    replay(path, descriptor)
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


@contextmanager
def reading(path: Path, error: type[Exception], advice: str = "") -> Iterator[h5py.File]:
    """Open an HDF5 file that may be damaged, or be of unknown origin; every fault ends in one message.

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


def _short(error: BaseException) -> str:
    text = " ".join((str(error) or type(error).__name__).split())
    return text if len(text) <= 200 else text[:197] + "..."
