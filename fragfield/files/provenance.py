"""Provenance of every output file: case, program, versions, seed, kind of machine, date."""

from __future__ import annotations

import json
import os
import platform
import subprocess
from datetime import UTC, datetime
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.case.write import to_toml
from fragfield.version import __version__
from fragfield_base.ambient import surroundings

if TYPE_CHECKING:
    from fragfield.case.schema import CaseTable

__all__ = ["provenance_of", "revision", "versions"]

_DISTRIBUTIONS = {
    "numpy": "numpy",
    "scipy": "scipy",
    "numba": "numba",
    "h5py": "h5py",
    "dolfinx": "fenics-dolfinx",
    "petsc4py": "petsc4py",
    "mpi4py": "mpi4py",
    "gmsh": "gmsh",
    "meshio": "meshio",
    "pyvista": "pyvista",
    "vtk": "vtk",
    "matplotlib": "matplotlib",
    "pydantic": "pydantic",
    "geographiclib": "geographiclib",
}


@cache
def versions() -> dict[str, str]:
    """Versions of the program, of Python and of what the results may depend on; nothing is imported for it."""
    found = {"fragfield": __version__, "python": platform.python_version()}
    for name, distribution in _DISTRIBUTIONS.items():
        try:
            found[name] = metadata.version(distribution)
        except metadata.PackageNotFoundError:
            continue
    return found


@cache
def revision() -> str:
    """Revision of the source tree the program runs from, with "+" for local changes; empty where installed."""
    root = Path(__file__).resolve().parents[2]
    if not (root / ".git").exists():
        return ""
    try:
        head = _git(root, "rev-parse", "--short=12", "HEAD")
        changed = _git(root, "status", "--porcelain", "--untracked-files=no")
    except (OSError, subprocess.SubprocessError):
        return ""
    return head + ("+" if changed else "")


def _git(root: Path, *arguments: str) -> str:
    # A variable such as GIT_DIR would name another repository.
    known = {name: value for name, value in os.environ.items() if not name.startswith("GIT_")}
    command = ["git", "-c", f"safe.directory={root}", "-C", str(root), *arguments]
    return subprocess.run(command, capture_output=True, text=True, timeout=10, check=True, env=known).stdout.strip()


def provenance_of(case: CaseTable) -> dict[str, str]:
    """What every output file of a run carries.

    Parameters
    ----------
    case : CaseTable
        The resolved case.

    Returns
    -------
    dict of str to str
        `case` (TOML), `versions` (JSON), `seed`, `program`, `program_version`, `revision`, `platform`, `environment`
        (JSON: variables of libraries that the command line has ignored, and that it has kept) and `date` (UTC).
    """
    return {
        "case": to_toml(case),
        "versions": json.dumps(versions(), sort_keys=True),
        "seed": str(case.seed),
        "program": "fragfield",
        "program_version": __version__,
        "revision": revision(),
        "platform": f"{platform.system()} {platform.machine()}, Python {platform.python_version()}",
        "environment": json.dumps(surroundings(), sort_keys=True),
        "date": datetime.now(UTC).isoformat(timespec="seconds"),
    }
