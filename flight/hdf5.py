"""Opening and stamping HDF5 files, with messages a user can act on."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING

from flight.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Iterator, Mapping
    from pathlib import Path

    import h5py

__all__ = ["open_checked", "write_attributes"]


def write_attributes(file: h5py.File, name: str, version: int, provenance: Mapping[str, str]) -> None:
    """Stamp the format's name and version and every provenance entry on the root of an open file."""
    for key, text in provenance.items():
        file.attrs[key] = str(text)
    file.attrs["format"] = name
    file.attrs["format_version"] = version


@contextmanager
def open_checked(path: Path, name: str, version: int) -> Iterator[h5py.File]:
    """Open a file of a known format for reading, or raise InputError saying what it is instead."""
    import h5py

    if not path.is_file():
        raise InputError(f"{path}: no such file")
    try:
        file = h5py.File(path, "r")
    except OSError as error:
        raise InputError(f"{path}: cut off, or not an HDF5 file ({error})") from None
    with file:
        found = file.attrs.get("format")
        found = found.decode() if isinstance(found, bytes) else found
        if found != name:
            raise InputError(f"{path}: attribute format is {found!r}, needed {name!r}")
        if int(file.attrs.get("format_version", -1)) != version:
            raise InputError(
                f"{path}: format_version is {file.attrs.get('format_version')}, this program reads {version}"
            )
        yield file
