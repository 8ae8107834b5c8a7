"""HDF5 files: written whole, in one move, and read after a check of their seal.

HDF5 does not recover from a failed write: a full disk ends it by signal 11, now or when the process exits. So the
library writes to memory alone, and what it has made is written as any other file (`fragfield_base.writing`). A file
that is read is checked first (`fragfield_base.hdf5_soundness`).
"""

from __future__ import annotations

import io
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fragfield_base.hdf5_soundness import check_sound
from fragfield_base.interruption import Interruption
from fragfield_base.seal import seal_of
from fragfield_base.writing import refuse_link, replacing

if TYPE_CHECKING:
    from collections.abc import Iterator
    from pathlib import Path

    import h5py

__all__ = ["check_sound", "creating", "reading"]

_VERSIONS = ("v108", "v110")  # 1.8 holds attributes above 64 kB: the case of a large stack
_READING_FAULTS = (
    OSError, RuntimeError, LookupError, ValueError, TypeError, AttributeError, ArithmeticError, MemoryError,
)  # fmt: skip


@contextmanager
def creating(path: Path, error: type[Exception]) -> Iterator[h5py.File]:
    """Make a new HDF5 file in memory; it is written, sealed, when the block ends without an error.

    Parameters
    ----------
    path : Path
        The file; an older one is replaced.
    error : type
        Raised, with one message, where it cannot be written.
    """
    import h5py

    refuse_link(path, error)
    with Interruption(patient=True):
        image = io.BytesIO()
        with h5py.File(image, "w", libver=_VERSIONS) as file:
            yield file
        with replacing(path, error) as stream:
            stream.write(image.getbuffer())
            stream.write(seal_of(image.getbuffer()))


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
