"""The seal of an HDF5 file: a digest of all of it after its last byte, checked before HDF5 opens the file.

HDF5 itself notices little: a flipped bit changes a number, or sends the library into memory that it does not own. A
file's own end is where HDF5 does not read, and where other programs (ParaView, h5dump) do not mind a few bytes more:

    ... HDF5 ... | size | digest of size and content | mark

A file that was cut or edited has no seal or a wrong one; one of other origin has none, see
`fragfield_base.hdf5_soundness`.
"""

from __future__ import annotations

import hashlib
import os
import struct
from typing import BinaryIO

__all__ = ["LENGTH", "SealError", "check_seal", "seal_of"]

_MARK = b"fragfield seal 2"
_DIGEST = 32
_SEAL = struct.Struct(f"<Q{_DIGEST}s{len(_MARK)}s")
LENGTH = _SEAL.size
"""Bytes of a seal."""
_PIECE = 1 << 20


class SealError(ValueError):
    """What the file holds is not what was sealed."""


def seal_of(content: bytes | memoryview) -> bytes:
    """What is written behind the content of a file."""
    digest = _started(len(content))
    digest.update(content)
    return _SEAL.pack(len(content), digest.digest(), _MARK)


def check_seal(file: BinaryIO) -> bool:
    """Whether an open file has a seal; raises SealError where it does not fit."""
    whole = os.fstat(file.fileno()).st_size
    if whole < LENGTH:
        return False
    file.seek(whole - LENGTH)
    size, sealed, mark = _SEAL.unpack(file.read(LENGTH))
    if mark != _MARK:
        return False
    if size + LENGTH != whole:
        raise SealError(f"it has {whole} bytes, which is not what its checksum was made of")
    digest = _started(size)
    file.seek(0)
    left = size
    while left > 0 and (piece := file.read(min(_PIECE, left))):
        digest.update(piece)
        left -= len(piece)
    if digest.digest() != sealed:
        raise SealError("its bytes do not match their checksum")
    return True


def _started(size: int) -> hashlib.blake2b:
    return hashlib.blake2b(struct.pack("<Q", size), digest_size=_DIGEST)
