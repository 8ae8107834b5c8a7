"""A copy of the project in which faults are tried: one at a time, by the tests that can notice it.

The copy keeps its place, and kernels compiled for it are kept beside it. A fault in a kernel changes the digest of its
package's sources, under which the cache lies; the new folder is filled with what the fault cannot have changed: kernels
of modules that do not import the faulty one, directly or through others.
"""

from __future__ import annotations

import ast
import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path

__all__ = ["Outcome", "Workshop", "importers"]

_FOLDERS = ("burst_fenicsx", "transition", "flight", "fragfield", "fragfield_base", "validation", "cases", "tests")
_FILES = ("pyproject.toml",)
_LIMITED = 'ulimit -v 16000000; ulimit -c 0; exec "$@"'  # kB of address space: a fault may ask for any amount
_COMPILING = 300.0  # s that kernels may take to compile, besides three times what the tests take without the fault
_CACHES = """
from burst_fenicsx.kernels import lanes
from flight.kernels import compiling as flight
from transition.kernels import compiling as transition
print(f"burst-{lanes._SOURCES} burst-{lanes._AXISYMMETRIC_SOURCES}")
print(f"flight-{flight._STAMP} transition-{transition._STAMP}")
"""


@dataclass(frozen=True)
class Outcome:
    """What the tests did: "passed", "failed" or "time" for running past it; seconds; the test that failed first."""

    state: str
    seconds: float
    test: str = ""


class Workshop:
    """The copy, its cache of kernels, and what the tests take there without a fault.

    Parameters
    ----------
    root : the project. folder : where the copy and the cache lie; what is there already is brought up to date.
    digest : names the state of the project, for which the times of the tests are kept.
    """

    def __init__(self, root: Path, folder: Path, digest: str) -> None:
        self.tree = folder / "tree"
        self.cache = folder / "cache"
        self.cache.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._lock = (folder / "lock").open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise SystemExit(f"another process tries faults in {folder}; wait for it") from None
        self._copy(root)
        self._times = folder / f"seconds_{digest}.json"
        known = json.loads(self._times.read_text()) if self._times.is_file() else {}
        self._usual = {test: Outcome("passed", seconds) for test, seconds in known.items()}
        self._caches = self._cache_names()
        for stale in set(self.cache.iterdir()) - {self.cache / name for name in self._caches}:
            shutil.rmtree(stale)

    def _copy(self, root: Path) -> None:
        """Copy what has changed, with its times: kernels from the cache are known by them."""
        wanted = {}
        for name in _FOLDERS:
            for path in (root / name).rglob("*"):
                if path.is_file() and "__pycache__" not in path.parts:
                    wanted[path.relative_to(root)] = path
        wanted |= {Path(name): root / name for name in _FILES}
        for relative, path in wanted.items():
            copy = self.tree / relative
            if not copy.is_file() or copy.read_bytes() != path.read_bytes():
                copy.parent.mkdir(parents=True, exist_ok=True)
                shutil.copy2(path, copy)
        for path in [path for path in self.tree.rglob("*") if path.is_file()]:
            if path.relative_to(self.tree) not in wanted:
                path.unlink()

    def without_fault(self, tests: list[str]) -> Outcome:
        """The tests as they are, each file once: compiled kernels are kept, and times beside them for the next call."""
        found = [self._usual[test] if test in self._usual else self._measured(test) for test in tests]
        failed = [outcome for outcome in found if outcome.state != "passed"]
        return failed[0] if failed else Outcome("passed", sum(outcome.seconds for outcome in found))

    def _measured(self, test: str) -> Outcome:
        self._usual[test] = outcome = self._run([test], 3600.0)
        if outcome.state == "passed":
            known = {name: one.seconds for name, one in self._usual.items() if one.state == "passed"}
            self._times.write_text(json.dumps(known, indent=1))
        return outcome

    def with_fault(self, module: str, text: str, tests: list[str]) -> Outcome:
        """The tests with another text of a module (its path from the root), which is put back afterwards."""
        path = self.tree / module
        before, times = path.read_bytes(), path.stat()
        limit = 3.0 * self.without_fault(tests).seconds + _COMPILING
        try:
            path.write_text(text)
            caches = self._cache_names()
            for usual, own in zip(self._caches, caches, strict=True):
                if usual != own:
                    self._share(self.cache / usual, self.cache / own, module)
            return self._run(tests, limit)
        finally:
            path.write_bytes(before)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            for own in set(caches) - set(self._caches):
                shutil.rmtree(self.cache / own, ignore_errors=True)

    def _cache_names(self) -> list[str]:
        """Folders of the cache for the sources as they are."""
        command = [sys.executable, "-c", _CACHES]
        done = subprocess.run(
            command, cwd=self.tree, env=self._environment(), capture_output=True, text=True, check=True
        )
        return done.stdout.split()

    def _share(self, usual: Path, own: Path, module: str) -> None:
        """Link the kernels that do not depend on a module into another folder of the cache."""
        package = module.partition("/")[0]
        dependent = {(Path(name).parent.name, Path(name).stem) for name in importers(self.tree / package, module)}
        for path in usual.rglob("*.nb?"):
            folder = path.parent.name.rpartition("_")[0]
            if (folder, path.name.split(".")[0]) not in dependent:
                (own / path.parent.name).mkdir(mode=0o700, parents=True, exist_ok=True)
                os.link(path, own / path.parent.name / path.name)

    def _environment(self) -> dict[str, str]:
        return {
            **os.environ,
            "PYTHONPATH": str(self.tree),
            "PYTHONDONTWRITEBYTECODE": "1",
            "NUMBA_CACHE_DIR": str(self.cache),
            "NUMBA_NUM_THREADS": "1",
        }

    def _run(self, tests: list[str], limit: float) -> Outcome:
        """Run tests until one fails."""
        options = ["-x", "-q", "-rfE", "--tb=no", "-p", "no:cacheprovider", "-m", "not slow and not mpi"]
        began = time.monotonic()
        process = subprocess.Popen(
            ["sh", "-c", _LIMITED, "sh", sys.executable, "-m", "pytest", *options, *tests],
            cwd=self.tree, env=self._environment(), stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
            errors="replace", start_new_session=True,
        )  # fmt: skip
        try:
            words, _ = process.communicate(timeout=limit)
        except subprocess.TimeoutExpired:
            return Outcome("time", time.monotonic() - began, "ran past its time")
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.communicate()
        seconds = time.monotonic() - began
        if process.returncode == 0:
            return Outcome("passed", seconds)
        failed = [line.split(" ", 1)[1] for line in words.splitlines() if line.startswith(("FAILED ", "ERROR "))]
        return Outcome("failed", seconds, failed[0] if failed else f"exit code {process.returncode}")


def importers(package: Path, module: str) -> set[str]:
    """A module (path from the folder above the package) and all modules of its package that come to import it."""
    root = package.parent
    imported = {}
    for path in package.rglob("*.py"):
        names = set()
        for node in ast.walk(ast.parse(path.read_text())):
            if isinstance(node, ast.ImportFrom) and node.module:
                names |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
            elif isinstance(node, ast.Import):
                names |= {alias.name for alias in node.names}
        imported[str(path.relative_to(root))] = names
    found = {module}
    while True:
        known = {name.removesuffix(".py").replace("/", ".") for name in found}
        more = {name for name, names in imported.items() if names & known} - found
        if not more:
            return found
        found |= more
