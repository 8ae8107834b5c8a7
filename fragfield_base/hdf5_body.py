"""The body of an HDF5 file: the buffer that the HDF5 library writes to instead of the disk.

HDF5 does not recover from a failed write: a full disk ends it by signal 11, now or when the process exits. It can
always write to a `Body`, which passes the bytes on and keeps the first OSError to itself, to be raised once, later.
"""

from __future__ import annotations

import io
import os
from typing import TYPE_CHECKING, Any

from fragfield_base.seal import BLOCK

if TYPE_CHECKING:
    from collections.abc import Iterator

__all__ = ["Body", "write_at"]

_PAGE = 4096


class Body(io.RawIOBase):
    """A file as h5py's driver for Python objects uses it: no method raises, the first fault is kept.

    Bytes below `base` are not touched on the disk: their changed pages are kept in `pages`.
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
        """As `io.RawIOBase`: always."""
        return True

    def writable(self) -> bool:
        """As `io.RawIOBase`: always."""
        return True

    def seekable(self) -> bool:
        """As `io.RawIOBase`: always."""
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move to a position of the body (as `io.RawIOBase`) and return it."""
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self.size}[whence]
        self._at = start + offset
        return self._at

    def tell(self) -> int:
        """Return the position in the body."""
        return self._at

    def readinto(self, buffer: Any) -> int:  # noqa: ANN401 - any buffer
        """Fill `buffer` from here on; zeros where nothing has been written."""
        view = memoryview(buffer).cast("B")
        view[:] = self._bytes(self._at, len(view))
        self._at += len(view)
        return len(view)

    def write(self, data: Any) -> int:  # noqa: ANN401 - any buffer
        """Keep or pass on `data`; never raises."""
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
        """Set the size of the body; never raises."""
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

    def raise_fault(self) -> None:
        """Raise the first OSError, if there was one."""
        if self.fault is not None:
            raise self.fault

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
