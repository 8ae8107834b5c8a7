"""HDF5 files: written whole, in one move, with a seal, and read after a check of it.

HDF5 does not recover from a failed write: a full disk ends it by signal 11, now or when the process exits. So the
library writes to memory alone, and what it has made is written as any other file (`fragfield_base.writing`). It notices
little when it reads: a flipped bit changes a number, or sends the library into memory that it does not own. So a file
ends with a digest of all of it, where HDF5 does not read, and where other programs (ParaView, h5dump) do not mind:

    ... HDF5 ... | size | digest of size and content | mark

A file that was cut or edited has no seal or a wrong one. One of other origin has none: it is looked
through first.
"""

from __future__ import annotations

import hashlib
import io
import os
import stat
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, BinaryIO

from fragfield_base.interruption import Interruption
from fragfield_base.writing import refuse_link, replacing

if TYPE_CHECKING:
    import h5py


_VERSIONS = ("v108", "v110")  # 1.8 holds attributes above 64 kB: the case of a large stack
_READING_FAULTS = (
    OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError, MemoryError,
)  # fmt: skip
_MARK = b"fragfield seal 2"
_DIGEST = 32
_SEAL = struct.Struct(f"<Q{_DIGEST}s{len(_MARK)}s")
SEAL_LENGTH = _SEAL.size
"""Bytes of a seal."""
_PIECE = 1 << 20
_sound: dict[str, tuple[int, int, int]] = {}  # files whose seal this process has checked, as they were then


class _SealError(ValueError):
    """What the file holds is not what was sealed."""


@contextmanager
def creating(path: Path, error: type[Exception], *, durable: bool = True) -> Iterator[h5py.File]:
    """Make a new HDF5 file in memory; it is written, sealed, when the block ends without an error.

    An older file is replaced, `durable` as by `replacing`; raises `error`, with one message, where it cannot be.
    """
    h5py = _library(path, error)
    refuse_link(path, error)
    with Interruption(patient=True):
        image = io.BytesIO()
        with h5py.File(image, "w", libver=_VERSIONS) as file:
            yield file
        with replacing(path, error, durable=durable) as stream:
            stream.write(image.getbuffer())
            stream.write(_seal_of(image.getbuffer()))


@contextmanager
def reading(path: Path, error: type[Exception], advice: str = "") -> Iterator[h5py.File]:
    """Open an HDF5 file that may be damaged, or be of unknown origin; every fault ends in one message.

    Raises `error` for a file that is missing, damaged, larger than memory, or in which the block does not find what it
    looks for, with `advice` at the end; errors of this class pass as they are.
    """
    h5py = _library(path, error)
    check_sound(path, error, advice)
    end = f"; {advice}" if advice else ""
    try:
        file = h5py.File(path, "r", locking=False)  # some file systems have none
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


def _library(path: Path, error: type[Exception]) -> Any:  # noqa: ANN401 - a module
    try:
        import h5py
    except ModuleNotFoundError:
        raise error(f'{path}: an HDF5 file needs h5py: pip install "fragfield-flight[hdf5]"') from None
    return h5py


def _short(error: BaseException) -> str:
    text = " ".join((str(error) or type(error).__name__).split())
    return text if len(text) <= 200 else text[:197] + "..."


def check_sound(path: Path, error: type[Exception], advice: str = "") -> None:
    """Refuse a file that is missing, no regular file, or not as it was sealed; `error` with one message."""
    end = f"; {advice}" if advice else ""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise error(f"{path}: not a file")
        before = _state(path)
        if _sound.get(str(path)) == before:
            return
        with path.open("rb") as file:
            is_sealed = _is_sealed(file)
    except FileNotFoundError:
        raise error(f"{path}: no such file{end}") from None
    except OSError as found:
        raise error(f"{path}: cannot be read ({found.strerror or found}){end}") from None
    except _SealError as found:
        raise error(f"{path}: damaged, cut off or changed since it was written: {found}{end}") from None
    if not is_sealed:
        try:
            with _library(path, error).File(path, "r", locking=False) as file:
                fault = _looked_through(file, before[1])
        except _READING_FAULTS as found:
            raise error(f"{path}: cut off, or not an HDF5 file ({_short(found)}){end}") from None
        if fault is not None:
            raise error(f"{path}: {fault}{end}")
    _sound[str(path)] = before


def _state(path: Path) -> tuple[int, int, int]:
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns


def _seal_of(content: bytes | memoryview) -> bytes:
    """What is written behind the content of a file."""
    digest = _started(len(content))
    digest.update(content)
    return _SEAL.pack(len(content), digest.digest(), _MARK)


def _is_sealed(file: BinaryIO) -> bool:
    """Whether an open file has a seal; raises _SealError where it does not fit."""
    whole = os.fstat(file.fileno()).st_size
    if whole < SEAL_LENGTH:
        return False
    file.seek(whole - SEAL_LENGTH)
    size, sealed, mark = _SEAL.unpack(file.read(SEAL_LENGTH))
    if mark != _MARK:
        return False
    if size + SEAL_LENGTH != whole:
        raise _SealError(f"it has {whole} bytes, which is not what its checksum was made of")
    digest = _started(size)
    file.seek(0)
    left = size
    while left > 0 and (piece := file.read(min(_PIECE, left))):
        digest.update(piece)
        left -= len(piece)
    if digest.digest() != sealed:
        raise _SealError("its bytes do not match their checksum")
    return True


def _started(size: int) -> hashlib.blake2b:
    return hashlib.blake2b(struct.pack("<Q", size), digest_size=_DIGEST)


_DEFLATE = 1040  # no deflated data is smaller than this share
_SMALL = 1 << 26
_FILTERS = {1, 2, 3, 4}  # deflate, shuffle, checksum, szip


def _looked_through(file: h5py.File, size: int) -> str | None:
    """What is wrong with a file of another program, of `size` bytes: links and data that are elsewhere, or too much."""
    import h5py

    seen, waiting = set(), [file]
    while waiting:
        group = waiting.pop()
        for name in group:
            where = f"{group.name.rstrip('/')}/{name}"
            if not isinstance(group.get(name, getlink=True), h5py.HardLink):
                return f"{where} is a link to elsewhere, which is not followed"
            item = group[name]
            place = h5py.h5o.get_info(item.id).addr
            if place in seen:
                continue
            seen.add(place)
            if isinstance(item, h5py.Group):
                waiting.append(item)
            elif isinstance(item, h5py.Dataset) and (fault := _fault_of_data(item, size)):
                return f"{where} {fault}"
    return None


def _fault_of_data(data: h5py.Dataset, size: int) -> str | None:
    plist = data.id.get_create_plist()
    if plist.get_external_count() or getattr(data, "is_virtual", False):
        return "lies in another file, which is not read"
    filters = [plist.get_filter(number)[0] for number in range(plist.get_nfilters())]
    if not set(filters) <= _FILTERS:
        return f"is packed by the filter {min(set(filters) - _FILTERS)}; allowed: deflate (gzip)"
    declared = int(data.size or 0) * data.dtype.itemsize
    most = max(size * (_DEFLATE if filters else 1), _SMALL)
    if declared > most:
        return f"declares {declared} bytes, which a file of {size} bytes cannot hold"
    return None
