"""Provenance of every output file: case, program, versions, seed, kind of machine, date; and `fragfield info`."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from contextlib import suppress
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield.case.schema import CaseTable
from fragfield.case.write import to_toml
from fragfield.errors import InputError, nearest
from fragfield.files.run_directory import STAGES, RunDirectory
from fragfield_base.ambient import kept_variables
from fragfield_base.arrays import text_of
from fragfield_base.hdf5_files import reading
from fragfield_base.version import __version__

if TYPE_CHECKING:
    import h5py


_LIBRARIES = "numpy scipy numba h5py dolfinx petsc4py mpi4py mpich gmsh meshio matplotlib pydantic geographiclib"
_MAKERS = {"dolfinx": ("fenics-dolfinx", "dolfinx-solver-real")}  # PyPI's wheel is named by its maker


@cache
def versions() -> dict[str, str]:
    """Versions of the program, of Python and of what the results may depend on; nothing is imported for it."""
    found = {"fragfield": __version__, "python": platform.python_version()}
    for name in _LIBRARIES.split():
        for distribution in _MAKERS.get(name, (name,)):
            with suppress(metadata.PackageNotFoundError):
                found[name] = metadata.version(distribution)
    return found


@cache
def revision() -> str:
    """Revision of the source tree the program runs from, with "+" for local changes; empty where installed."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""
    # A variable such as GIT_DIR would name another repository.
    known = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "-c", f"safe.directory={root}", "-C", str(root), "describe", "--always", "--exclude=*"]
    command += ["--abbrev=12", "--dirty=+"]
    try:
        found = subprocess.run(command, capture_output=True, text=True, timeout=10, check=True, env=known)
    except (OSError, subprocess.SubprocessError):
        return ""
    return found.stdout.strip()


def provenance_of(case: CaseTable) -> dict[str, str]:
    """What every output file of a run of a resolved case carries.

    `case` (TOML), `versions` (JSON), `seed`, `program`, `program_version`, `revision`, `platform`, `environment` (JSON:
    the user's variables of threads and of the processor) and `date` (UTC).
    """
    return {
        "case": to_toml(case),
        "versions": json.dumps(versions(), sort_keys=True),
        "seed": str(case.seed),
        "program": "fragfield",
        "program_version": __version__,
        "revision": revision(),
        "platform": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        "environment": json.dumps(kept_variables(), sort_keys=True),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }


def describe(path: Path) -> dict[str, Any]:
    """Describe a run directory or an HDF5 file.

    Of a directory `directory`, `title`, `stages`, `files` (bytes) and `summary`; of a file `file`, `format`,
    `attributes` and `datasets` (shape and type). Raises InputError: there is no such thing, or the file is cut off or
    not one of this program's.
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
