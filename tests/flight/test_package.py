"""The package alone: what its import brings along, and what its notebook example prints."""

from __future__ import annotations

import doctest
import math
import os
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest

import flight

ROOT = Path(flight.__file__).parent.parent


def test_flying_needs_no_other_of_ours() -> None:
    code = "import sys, flight; one = flight.fly(flight.Fragments(0.1, (0, 0, 1), (1, 0, 0)))\n"
    code += "assert not {'dolfinx', 'mpi4py', 'burst_fenicsx', 'transition', 'fragfield', 'pyvista'} & set(sys.modules)"
    kept = {name: os.environ[name] for name in ("NUMBA_CACHE_DIR",) if name in os.environ}  # else it compiles again
    code += "\nprint(one.summary['landed'], float(one.landing['time'][0]))"
    done = subprocess.run(
        [sys.executable, "-c", code], check=True, cwd=ROOT, env={"PYTHONPATH": str(ROOT), **kept}, capture_output=True,
        text=True,
    )  # fmt: skip
    landed, time = done.stdout.split()
    assert landed == "1"
    assert float(time) == pytest.approx(math.sqrt(2.0 / 9.80665), rel=5e-3)  # a slow drop from 1 m, hardly braked


def test_example_of_the_package() -> None:
    result = doctest.testmod(flight)
    assert result.attempted == 4
    assert result.failed == 0


def test_the_distribution_lists_every_folder_of_the_package() -> None:
    """Its build takes no folder that is not named."""
    folder = ROOT / "flight"
    listed = tomllib.loads((folder / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]["packages"]
    there = {".".join(("flight", *path.parent.relative_to(folder).parts)) for path in folder.rglob("__init__.py")}
    assert set(listed) == there | {"fragfield_base", "fragfield_base.substances"}
