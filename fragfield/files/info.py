"""`fragfield info`: content and origin of a run directory or an HDF5 file."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Any

from fragfield.errors import InputError, nearest
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield_base.arrays import text_of
from fragfield_base.hdf5_files import reading

if TYPE_CHECKING:
    from pathlib import Path

    import h5py

__all__ = ["describe"]


def describe(path: Path) -> dict[str, Any]:
    """Describe a run directory or an HDF5 file.

    Parameters
    ----------
    path : Path
        Directory or file.

    Returns
    -------
    dict
        For a directory `directory`, `title`, `stages`, `files` (bytes) and `summary`; for a file `file`, `format`,
        `attributes` and `datasets` (shape and type).

    Raises
    ------
    InputError
        There is no such thing, or the file is cut off or not one of this program's.
    """
    if path.is_dir():
        return _directory(RunDirectory(path))
    if path.exists() and not path.is_file():
        raise InputError(f"{path}: not a regular file; allowed: a run directory or an HDF5 file (.h5)")
    if not path.is_file():
        beside = [entry.name for entry in path.parent.iterdir()] if path.parent.is_dir() else []
        raise InputError(f"{path}: no such file or directory{nearest(path.name, beside)}")
    return _file(path)


def _directory(run: RunDirectory) -> dict[str, Any]:
    case = run.stored_case()
    return {
        "directory": str(run.path),
        "title": case.title,
        "stages": {name: run.complete(stage) for name, stage in STAGES.items()},
        "files": {entry.name: entry.stat().st_size for entry in sorted(run.path.iterdir()) if entry.is_file()},
        "summary": {key: value for key, value in run.summary().items() if key != "case"},
    }


def _file(path: Path) -> dict[str, Any]:
    if path.suffix.lower() not in (".h5", ".hdf5"):
        raise InputError(
            f"{path}: found a file that ends in {path.suffix!r}; allowed: a run directory or an HDF5 file (.h5)"
        )
    with reading(path, InputError) as file:
        attributes = {key: _text(value) for key, value in file.attrs.items()}
        datasets: dict[str, str] = {}
        file.visititems(lambda name, item: _note(datasets, name, item))
    return {
        "file": str(path),
        "format": attributes.pop("format", "unknown"),
        "attributes": attributes,
        "datasets": datasets,
    }


def _note(datasets: dict[str, str], name: str, item: h5py.Dataset | h5py.Group) -> None:
    if hasattr(item, "shape"):
        kind = "table of " + ", ".join(item.dtype.names) if item.dtype.names else str(item.dtype)
        datasets[name] = f"{' x '.join(str(length) for length in item.shape) or 'scalar'} {kind}"


def _text(value: object) -> object:
    value = text_of(value) if isinstance(value, bytes) else value
    value = value.tolist() if hasattr(value, "tolist") else value
    if isinstance(value, str) and value.startswith("{"):
        try:
            return json.loads(value)
        except ValueError:
            return value
    return value
