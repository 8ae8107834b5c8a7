"""Checks an HDF5 file of unknown origin, in a separate process that may crash.

Refused are links (they may lead to other files or in circles),
data outside of the file, filters that load code, and data larger than the file or the memory can hold.
"""

from __future__ import annotations

import os
import resource
import sys
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import h5py

__all__ = ["probe"]

_SECONDS = 50
_MOST_OBJECTS = 200_000
_DEFLATE = 1040  # no deflated data is smaller than this share
_SMALL = 1 << 26
_FILTERS = {1, 2, 3, 4}  # deflate, shuffle, checksum, szip


def probe(path: str) -> None:
    """Print what is wrong with a file and end the process with 1, or with 0 if nothing is."""
    if (fault := _fault(path)) is not None:
        sys.stdout.write(fault + "\n")
        sys.stdout.flush()
    os._exit(0 if fault is None else 1)  # a damaged file may still crash HDF5 on its way out


def _fault(path: str) -> str | None:
    resource.setrlimit(resource.RLIMIT_CPU, (_SECONDS, _SECONDS))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    import h5py

    try:
        with h5py.File(path, "r", locking=False) as file:
            return _looked_through(file, Path(path).stat().st_size)
    except RecursionError:
        return "groups nested too deep"
    except Exception as error:  # noqa: BLE001 - whatever it is, the file is not sound
        return f"cut off, or not an HDF5 file ({' '.join(str(error).split())[:200]})"


def _looked_through(file: h5py.File, size: int) -> str | None:
    import h5py

    total, seen, waiting = 0, set(), [file]
    memory = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES") // 2
    while waiting:
        group = waiting.pop()
        _attributes(group)
        for name in group:
            link = group.get(name, getlink=True)
            where = f"{group.name.rstrip('/')}/{name}"
            if not isinstance(link, h5py.HardLink):
                return f"{where} is a link to elsewhere, which is not followed"
            item = group[name]
            place = h5py.h5o.get_info(item.id)
            if place.addr in seen:
                continue
            seen.add(place.addr)
            if len(seen) > _MOST_OBJECTS:
                return f"more than {_MOST_OBJECTS} groups and datasets"
            if isinstance(item, h5py.Group):
                waiting.append(item)
                continue
            if not isinstance(item, h5py.Dataset):
                continue
            _attributes(item)
            if fault := _fault_of(item, size):
                return f"{where} {fault}"
            total += _bytes(item)
    if total > memory:
        return f"declares {total / 1e9:.3g} GB of data, more than half of this machine's memory"
    return None


def _attributes(item: h5py.Group | h5py.Dataset) -> None:
    for name in item.attrs:
        item.attrs.get(name)


def _bytes(data: h5py.Dataset) -> int:
    return int(data.size or 0) * int(data.dtype.itemsize)


def _fault_of(data: h5py.Dataset, size: int) -> str | None:
    plist = data.id.get_create_plist()
    if plist.get_external_count() or getattr(data, "is_virtual", False):
        return "lies in another file, which is not read"
    filters = [plist.get_filter(number)[0] for number in range(plist.get_nfilters())]
    if not set(filters) <= _FILTERS:
        return f"is packed by the filter {min(set(filters) - _FILTERS)}; allowed: deflate (gzip)"
    most = max(size * (_DEFLATE if filters else 1), _SMALL)
    if _bytes(data) > most:
        return f"declares {_bytes(data)} bytes, which a file of {size} bytes cannot hold"
    return None
