"""A copy of the project in which faults are tried: one at a time, by the tests that can notice it, quick ones first.

The copy keeps its place, and kernels compiled for it are kept beside it. A fault in a kernel is tried in plain Python
first (`interpreted`), by the tests that are quick and pass there: most faults are found in seconds so. Only what these
do not notice is compiled. It changes the digest of its package's sources, under which the cache lies; the new folder is
filled with what the fault cannot have changed: kernels of modules that do not import the faulty one, directly or
through others.
"""

from __future__ import annotations

import fcntl
import hashlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tests.mutants.targets import names_imported

if TYPE_CHECKING:
    from collections.abc import Sequence

__all__ = ["Outcome", "Workshop", "importers", "is_compiled", "shared_digest", "test_files"]

_FOLDERS = ("burst_fenicsx", "transition", "flight", "fragfield", "fragfield_base", "validation", "cases", "tests")
_PACKAGES = ("burst_fenicsx", "transition", "flight", "fragfield_base")
_FILES = ("pyproject.toml",)
_PLUGINS = ("plan.py", "interpreted.py")
# kB of address space: a fault may ask for any amount; processor seconds, since other processes may take the cores.
_LIMITED = 'ulimit -v 16000000; ulimit -c 0; ulimit -t "$1"; shift; exec "$@"'
_COMPILING = 300.0  # processor s that kernels may take to compile, besides three times what the tests take usually
_WAITING = 10.0  # times the processor seconds that a trial may last
_ATTEMPTS = 2  # at the tests of a file without a fault: one that waits for something may fail on a busy machine
_NO_TESTS = 5  # exit status of pytest where no test was chosen
_HUNG = 30.0  # s that a test may still wait once it has been stopped
_INTERPRETED = 0.6  # processor s a test may take in plain Python
_CACHES = """
from burst_fenicsx.kernels import lanes
from flight.kernels import compiling as flight
from transition.kernels import compiling as transition
print(f"burst-{lanes._SOURCES} burst-{lanes._AXISYMMETRIC_SOURCES}")
print(f"flight-{flight._STAMP} transition-{transition._STAMP}")
"""


@dataclass(frozen=True)
class Outcome:
    """What the tests did: "passed", "failed" or "time" for running past it; processor seconds; the first that failed.

    `plain` says that the kernels were not compiled.
    """

    state: str
    seconds: float
    test: str = ""
    plain: bool = False


def is_compiled(text: str) -> bool:
    """Whether a module has functions that numba compiles."""
    return re.search(r"^@(\w*kernel|lane_function|numba\.njit|njit)\b", text, re.MULTILINE) is not None


def test_files(root: Path, tests: Sequence[str]) -> list[str]:
    """Files (paths from the root) for files and folders, each once, in their order; single tests stay."""
    found: dict[str, None] = {}
    for test in tests:
        path = root / test
        files = sorted(path.rglob("test_*.py")) if path.is_dir() else [path]
        found |= dict.fromkeys(str(file.relative_to(root)) for file in files)
    return list(found)


def shared_digest(root: Path, *, tests: bool = True) -> str:
    """Names the state of the program; with `tests`, also of what test files share."""
    found = hashlib.sha256()
    paths = [path for package in _PACKAGES for path in (root / package).rglob("*.py")]
    if tests:
        helpers = [path for path in (root / "tests").rglob("*.py") if not path.name.startswith("test_")]
        # Of this folder the plugins alone take part in a trial: which faults are tried by what changes no test.
        paths += [path for path in helpers if path.parent.name != "mutants" or path.name in _PLUGINS]
    for path in sorted(paths):
        found.update(path.read_bytes())
    return found.hexdigest()[:12]


class Workshop:
    """The copy, its cache of kernels, and what the tests take there without a fault.

    Parameters
    ----------
    root : the project. folder : where the copy and the cache lie; what is there already is brought up to date.
    """

    def __init__(self, root: Path, folder: Path) -> None:
        self.tree = folder / "tree"
        self.cache = folder / "cache"
        self.cache.mkdir(mode=0o700, parents=True, exist_ok=True)
        self._folder = folder
        self._lock = (folder / "lock").open("w")
        try:
            fcntl.flock(self._lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise SystemExit(f"another process tries faults in {folder}; wait for it") from None
        self._copy(root)
        self._shared = shared_digest(self.tree)
        self._times = folder / "usual.json"
        known = json.loads(self._times.read_text()) if self._times.is_file() else {}
        self._usual: dict[str, dict[str, float]] = known.get(self._shared, {})
        self._caches = self._cache_names()
        for stale in set(self.cache.iterdir()) - {self.cache / name for name in self._caches}:
            shutil.rmtree(stale)

    def _copy(self, root: Path) -> None:
        """Copy what has changed, with its times: kernels from the cache are known by them."""
        wanted = {}
        for folder in _FOLDERS:
            for path in (root / folder).rglob("*"):
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

    def digest_of(self, tests: Sequence[str]) -> str:
        """Names the state of test files and of what they share."""
        found = hashlib.sha256(self._shared.encode())
        for test in test_files(self.tree, tests):
            found.update((self.tree / test.partition("::")[0]).read_bytes())
        return found.hexdigest()[:12]

    def usual(self, tests: Sequence[str], kind: str = "compiled") -> dict[str, float]:
        """Processor seconds of the tests that pass without a fault, measured once for a state of their file.

        `kind` is "compiled", "plain" (in plain Python) or "ranks" (the tests on several ranks alone).

        Raises
        ------
        RuntimeError
            A test fails although there is no fault (in plain Python such a test is left out).
        """
        found: dict[str, float] = {}
        for test in test_files(self.tree, tests):
            key = f"{test} {self.digest_of([test])} {kind}"
            if key not in self._usual:
                plain = kind == "plain"
                limit = 3600.0 if not plain else 1200.0
                for attempt in range(_ATTEMPTS):
                    state, lines = self._run([test], {}, limit, kind, cap=_INTERPRETED if plain else 0.0)
                    failed = [line["test"] for line in lines if line["state"] in ("failed", "error")]
                    if plain or (not failed and state in (0, _NO_TESTS)):
                        break
                    if attempt == _ATTEMPTS - 1:
                        raise RuntimeError(f"without a fault {test} fails: {' '.join(failed)} (exit code {state})")
                self._usual[key] = {line["test"]: line["seconds"] for line in lines if line["state"] == "passed"}
                self._times.write_text(json.dumps({self._shared: self._usual}, indent=1))
            found |= self._usual[key]
        return found

    def with_fault(self, module: str, text: str, tests: Sequence[str], ranks: Sequence[str] = ()) -> Outcome:
        """The tests with another text of a module (its path from the root), which is put back afterwards.

        Of `ranks`, the tests on several ranks follow where nothing has been noticed.
        """
        path = self.tree / module
        before, times = path.read_bytes(), path.stat()
        plain = self.usual(tests, "plain") if is_compiled(text) else {}
        usual = self.usual(tests)
        of_ranks = self.usual(ranks, "ranks")
        caches = self._caches
        try:
            path.write_text(text)
            spent = 0.0
            if plain:
                found = self._tried(tests, plain, "plain")
                if found.state == "failed":
                    return found
                spent = found.seconds
                caches = self._cache_names()
                for known, own in zip(self._caches, caches, strict=True):
                    if known != own:
                        self._share(self.cache / known, self.cache / own, module)
            found = self._tried(tests, usual)
            if found.state == "passed" and ranks:
                spent += found.seconds
                found = self._tried(ranks, of_ranks, "ranks")
            return Outcome(found.state, round(found.seconds + spent, 1), found.test)
        finally:
            path.write_bytes(before)
            os.utime(path, ns=(times.st_atime_ns, times.st_mtime_ns))
            for own in set(caches) - set(self._caches):
                shutil.rmtree(self.cache / own, ignore_errors=True)

    def _tried(self, tests: Sequence[str], usual: dict[str, float], kind: str = "compiled") -> Outcome:
        plain = kind == "plain"
        limit = 3.0 * sum(usual.values()) + (60.0 if plain else _COMPILING)
        cap = 3.0 * max(usual.values(), default=0.0) + 1.0 if plain else 0.0
        files = test_files(self.tree, tests)
        if plain:
            files = [file for file in files if any(f"{test}[".startswith((f"{file}::", f"{file}[")) for test in usual)]
        used = _children()
        status, lines = self._run(files, usual, limit, kind, cap=cap, decisive=plain)
        seconds = round(_children() - used, 1)
        failed = [line for line in lines if line["state"] == "failed" or (line["state"] == "error" and not plain)]
        if failed:
            return Outcome("failed", seconds, f"{failed[0]['test']} - {failed[0]['error']}", plain)
        if plain:
            return Outcome("passed", seconds, plain=True)
        if status in (-signal.SIGXCPU, -signal.SIGKILL, 128 + signal.SIGXCPU, 128 + signal.SIGKILL):
            return Outcome("time", seconds, "ran past its time")
        return (
            Outcome("passed", seconds)
            if status in (0, _NO_TESTS)
            else Outcome("failed", seconds, f"exit code {status}")
        )

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
            "PYTEST_DISABLE_PLUGIN_AUTOLOAD": "1",  # none is used in a trial, and loading them takes most of a second
        }

    def _run(
        self, tests: Sequence[str], order: dict[str, float], limit: float, kind: str, *, cap: float,
        decisive: bool | None = None,
    ) -> tuple[int, list[dict[str, Any]]]:  # fmt: skip
        """Run tests, to the end where `decisive` is None; exit status, and a record of each test."""
        plain = kind == "plain"
        plan, record = self._folder / "plan.json", self._folder / "record.jsonl"
        record.unlink(missing_ok=True)
        plan.write_text(
            json.dumps(
                {"order": order, "only": plain and bool(order), "limit": cap, "hung": _HUNG, "decisive": decisive,
                 "record": str(record)}
            )
        )  # fmt: skip
        marked = "not slow and mpi" if kind == "ranks" else "not slow and not mpi"
        options = ["-q", "--tb=no", "-p", "no:cacheprovider", "-p", "tests.mutants.plan", "-m", marked]
        environment = {**self._environment(), "MUTANTS_PLAN": str(plan)}
        if plain:
            options += ["-p", "tests.mutants.interpreted"]
            environment["NUMBA_DISABLE_JIT"] = "1"
        process = subprocess.Popen(
            ["sh", "-c", _LIMITED, "sh", str(int(limit) + 1), sys.executable, "-m", "pytest", *options, *tests],
            cwd=self.tree, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
            start_new_session=True,
        )  # fmt: skip
        try:
            status = process.wait(timeout=_WAITING * limit)
        except subprocess.TimeoutExpired:
            status = -signal.SIGKILL
        finally:
            if process.poll() is None:
                os.killpg(process.pid, signal.SIGKILL)
                process.wait()
        lines = record.read_text().splitlines() if record.is_file() else []
        return status, [json.loads(line) for line in lines]


def _children() -> float:
    used = os.times()
    return used.children_user + used.children_system


def importers(package: Path, module: str) -> set[str]:
    """A module (path from the folder above the package) and all modules of its package that come to import it."""
    root = package.parent
    imported = {str(path.relative_to(root)): names_imported(path) for path in package.rglob("*.py")}
    found = {module}
    while True:
        known = {name.removesuffix(".py").replace("/", ".") for name in found}
        more = {name for name, names in imported.items() if names & known} - found
        if not more:
            return found
        found |= more
