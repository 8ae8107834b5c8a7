"""What all tests share: parallel runs, and what happens where dolfinx or mpirun is missing."""

from __future__ import annotations

import importlib.util
import os
import shutil
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

if TYPE_CHECKING:
    from collections.abc import Callable

ROOT = Path(__file__).resolve().parent.parent


def pytest_configure() -> None:
    """Let mpirun work as root, wherever a test starts it."""
    if os.geteuid() == 0:
        os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT", "1")
        os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Leave out what this machine cannot run, unless `setup.sh test` asks for everything."""
    if os.environ.get("FRAGFIELD_REQUIRE_ALL"):
        return
    missing = {
        "dolfinx": importlib.util.find_spec("dolfinx") is None,
        "mpi": shutil.which("mpirun") is None or importlib.util.find_spec("mpi4py") is None,
    }
    for item in items:
        for marker in ("dolfinx", "mpi"):
            if missing[marker] and item.get_closest_marker(marker):
                item.add_marker(pytest.mark.skip(reason=f"{marker} is not here"))


@pytest.fixture
def mpirun() -> Callable[..., subprocess.CompletedProcess[str]]:
    """Run Python on several ranks, `mpirun(2, "-m", "fragfield", "check", case)`; a bad exit status fails the test."""

    def run(
        ranks: int,
        *arguments: str | Path,
        timeout: float = 300.0,
        check: bool = True,
        cwd: Path = ROOT,
        threads: int = 1,
    ):
        options = ["-n", str(ranks)]
        if _is_open_mpi():
            # A bound rank has one core, and then no second thread.
            bound = threads == 1 and ranks <= len(os.sched_getaffinity(0))
            options += ["--oversubscribe", "--bind-to", "core" if bound else "none"]
        # The ranks share the cores: one thread each, unless a test wants both.
        environment = {**os.environ, "NUMBA_NUM_THREADS": str(threads), "OMP_NUM_THREADS": "1"}
        command = ["mpirun", *options, sys.executable, *map(str, arguments)]
        done = subprocess.run(
            command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=timeout, check=False
        )
        if check and done.returncode != 0:
            pytest.fail(f"{' '.join(command)} ended with {done.returncode}\n{done.stdout}\n{done.stderr}")
        return done

    return run


def _is_open_mpi() -> bool:
    version = subprocess.run(["mpirun", "--version"], capture_output=True, text=True, check=False)
    return "Open MPI" in version.stdout or "open-mpi" in version.stdout.lower()
