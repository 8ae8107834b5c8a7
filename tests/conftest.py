"""What all tests share: parallel runs, and what happens where dolfinx or mpirun is missing."""

from __future__ import annotations

import importlib.util
import os
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import pytest

from fragfield_base.ambient import narrow
from fragfield_base.kernel_cache import cache_root
from tests.kernel_caches import folder_of, share
from tests.ranks import ROOT, Ranks, mpirun_command, mpirun_environment

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

WORKER = os.environ.get("PYTEST_XDIST_WORKER", "")
"""Name of this process among those of pytest-xdist; empty where there are none."""

narrow()
if os.environ.get("FRAGFIELD_PROCESSOR"):  # for processes that read no variables of ours; see `narrow`
    os.environ["PYTHONWARNINGS"] = "ignore:During parsing environment variable:RuntimeWarning"
if os.environ.get("PYTHONDONTWRITEBYTECODE") and (_ROOT := cache_root()) is not None:
    # Compiled sources are a fifth of every start of the program and two fifths of the collection: outside the tree.
    del os.environ["PYTHONDONTWRITEBYTECODE"]
    os.environ["PYTHONPYCACHEPREFIX"] = sys.pycache_prefix = str(_ROOT / "bytecode")
    sys.dont_write_bytecode = False


def pytest_configure(config: pytest.Config) -> None:
    """Let mpirun work as root, wherever a test starts it; give each worker its own cache of kernels and one thread."""
    if os.geteuid() == 0:
        os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT", "1")
        os.environ.setdefault("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1")
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
        # Started in the background of a shell: tests send themselves and their runs what it would have them ignore.
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if not WORKER:
        share(f"gw{number}" for number in range(getattr(config.option, "numprocesses", None) or 0))
    else:
        root = cache_root()
        if root is not None:
            folder = folder_of(root, WORKER)
            folder.mkdir(mode=0o700, parents=True, exist_ok=True)
            os.environ["NUMBA_CACHE_DIR"] = str(folder)
            cache_root.cache_clear()
        import numba

        # The others stay at hand for tests that ask for them.
        numba.set_num_threads(1)


@pytest.hookimpl(tryfirst=True)
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Group for `--dist loadgroup`, and leave out what this machine cannot run, unless `setup.sh test` asks for it.

    A file stays with one worker, so that its fixtures are made once. Tests that want several cores are one group: no
    two of them run at a time.
    """
    for item in items if WORKER else ():
        shared = item.get_closest_marker("mpi") or item.get_closest_marker("cores")
        item.add_marker(pytest.mark.xdist_group("cores" if shared else item.nodeid.split("::", maxsplit=1)[0]))
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
        # The ranks share the cores: one thread each, unless a test needs both.
        command = [*mpirun_command(ranks, threads), sys.executable, *map(str, arguments)]
        environment = mpirun_environment(threads)
        done = subprocess.run(
            command, cwd=cwd, env=environment, capture_output=True, text=True, timeout=timeout, check=False
        )
        if check and done.returncode != 0:
            pytest.fail(f"{' '.join(command)} ended with {done.returncode}\n{done.stdout}\n{done.stderr}")
        return done

    return run


@pytest.fixture(scope="session")
def on_ranks() -> Iterator[Callable[..., str]]:
    """Run a script on ranks that stay, `on_ranks(3, script, argument)`: see `tests.ranks`."""
    started: dict[int, Ranks] = {}

    def run(number: int, *arguments: str | Path) -> str:
        return started.setdefault(number, Ranks(number)).run(*arguments)

    yield run
    for ranks in started.values():
        ranks.close()
