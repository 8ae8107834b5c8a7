"""The seal of an HDF5 file: digests of its blocks after its last byte, checked before HDF5 opens the file.

HDF5 itself notices little: a flipped bit changes a number, or sends the library into memory that it does not own. A
file's own end is where HDF5 does not read, and where other programs (ParaView, h5dump) do not mind a few bytes more:

    ... HDF5 ... | digest of each block of 1 MiB (16 bytes each) | size | digest of size and digests | mark

Where blocks change, their digests alone are made again, so that a growing file costs what was added. A file that was
cut or edited has no seal or a wrong one; one of other origin has none (`fragfield_base.hdf5_files` looks closer then).
"""

from __future__ import annotations

import hashlib
import os
import struct
from concurrent.futures import ThreadPoolExecutor
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator, Sequence

__all__ = ["BLOCK", "Seal", "SealError", "read_seal", "sealed_size"]

BLOCK = 1 << 20
_DIGEST, _CHECK = 16, 32
_MARK = b"fragfield seal 1"
_FOOTER = struct.Struct(f"<Q{_CHECK}s{len(_MARK)}s")
_LARGEST = 1 << 44
_FEW = 8  # blocks for which threads are not worth their start
_THREADS = 4


class SealError(ValueError):
    """What the file holds is not what was sealed; the message says where."""


class Seal:
    """Digests of the blocks of a file's first `size` bytes."""

    def __init__(self, size: int, digests: list[bytes]) -> None:
        self.size = size
        self.digests = digests

    @classmethod
    def of(cls, descriptor: int, size: int) -> Seal:
        """Seal of the first `size` bytes of an open file."""
        seal = cls(0, [])
        seal.renew(descriptor, size, range(_blocks(size)))
        return seal

    def renew(self, descriptor: int, size: int, changed: Iterable[int]) -> None:
        """Make the digests of changed blocks again, and of those that the new size adds or cuts."""
        before = _blocks(self.size)
        ends = {before - 1, _blocks(size) - 1} if size != self.size else set()
        blocks = {*changed, *range(before, _blocks(size)), *ends}
        self.digests = self.digests[: _blocks(size)] + [b""] * (_blocks(size) - before)
        self.size = size
        numbers = sorted(block for block in blocks if 0 <= block < _blocks(size))
        for number, digest in zip(numbers, self._digests_of(descriptor, numbers), strict=True):
            self.digests[number] = digest

    def check(self, descriptor: int) -> None:
        """Raise SealError where a block is not what was sealed."""
        found = self._digests_of(descriptor, range(len(self.digests)))
        for number, (now, sealed) in enumerate(zip(found, self.digests, strict=True)):
            if now != sealed:
                raise SealError(f"its bytes from {number * BLOCK} on do not match their checksum")

    def to_bytes(self) -> bytes:
        """What is written behind the sealed bytes."""
        table = b"".join(self.digests)
        return table + _FOOTER.pack(self.size, _check_of(self.size, table), _MARK)

    def _digests_of(self, descriptor: int, numbers: Sequence[int]) -> Iterator[bytes]:
        """Digests of some blocks, in their order; many are made side by side, which takes no lock of Python's."""
        if len(numbers) < _FEW:
            yield from (self._digest(descriptor, number) for number in numbers)
            return
        with ThreadPoolExecutor(_THREADS) as pool:
            yield from pool.map(lambda number: self._digest(descriptor, number), numbers)

    def _digest(self, descriptor: int, number: int) -> bytes:
        length = min(BLOCK, self.size - number * BLOCK)
        data = _read(descriptor, number * BLOCK, length)
        if len(data) != length:
            raise SealError(f"it is cut off: {self.size} bytes were sealed")
        return hashlib.blake2b(data, digest_size=_DIGEST).digest()


def read_seal(descriptor: int) -> Seal | None:
    """Seal of an open file, None where there is none; raises SealError where it is damaged."""
    whole = os.fstat(descriptor).st_size
    if whole < _FOOTER.size:
        return None
    size, check, mark = _FOOTER.unpack(_read(descriptor, whole - _FOOTER.size, _FOOTER.size))
    if mark != _MARK:
        return None
    length = _blocks(size) * _DIGEST if size <= _LARGEST else -1
    if length < 0 or size + length + _FOOTER.size != whole:
        raise SealError(f"it has {whole} bytes, which is not what its checksum was made of")
    table = _read(descriptor, size, length)
    if _check_of(size, table) != check:
        raise SealError("its table of checksums is damaged")
    return Seal(size, [table[start : start + _DIGEST] for start in range(0, length, _DIGEST)])


def sealed_size(descriptor: int) -> int:
    """Bytes of an open file without its seal."""
    seal = read_seal(descriptor)
    return os.fstat(descriptor).st_size if seal is None else seal.size


def _blocks(size: int) -> int:
    return -(-size // BLOCK)


def _check_of(size: int, table: bytes) -> bytes:
    return hashlib.blake2b(struct.pack("<Q", size) + table, digest_size=_CHECK).digest()


def _read(descriptor: int, offset: int, length: int) -> bytes:
    parts = []
    while length > 0 and (part := os.pread(descriptor, length, offset)):
        parts.append(part)
        offset, length = offset + len(part), length - len(part)
    return b"".join(parts)
