"""Ranks that stay: scripts run one after another on ranks that have been started once.

A rank takes more than a second to load dolfinx, numba and kernels, which is most of what a short test on several of
them costs. `Ranks(3)` starts `mpirun -n 3 python -m tests.ranks FOLDER` when the first script comes. Between scripts
the ranks look for the next one in the folder, which unlike a receive of MPI takes no processor. A script must leave the
modules as they were. What is about the process itself (exit codes, messages, signals) starts mpirun by itself.
"""

from __future__ import annotations

import importlib
import io
import json
import os
import runpy
import subprocess
import sys
import tempfile
import time
import traceback
from contextlib import redirect_stdout
from pathlib import Path

__all__ = ["ROOT", "Ranks", "mpirun_command", "mpirun_environment"]

ROOT = Path(__file__).resolve().parent.parent
_POLL = 0.02  # s


class Ranks:
    """Ranks started once; `run` is one script on all of them.

    Parameters
    ----------
    number : int
        How many.
    """

    def __init__(self, number: int) -> None:
        self.number = number
        self._folder = tempfile.TemporaryDirectory(prefix="fragfield-ranks-")
        self._jobs = 0
        self._process: subprocess.Popen[bytes] | None = None

    def run(self, *arguments: str | Path, timeout: float = 300.0) -> str:
        """Run `SCRIPT ARGUMENT...`, or `main` of `-m MODULE ARGUMENT...`; what all ranks printed, in their order.

        Raises
        ------
        RuntimeError
            The script failed on a rank, or was not done in `timeout` (s); the ranks are started again by the next one.
        """
        folder = Path(self._folder.name)
        if self._process is None:
            self._jobs = 0
            for left in folder.iterdir():
                left.unlink()
            with (folder / "stderr").open("wb") as errors:
                self._process = subprocess.Popen(
                    [*mpirun_command(self.number), sys.executable, "-m", "tests.ranks", str(folder)],
                    cwd=ROOT, env=mpirun_environment(), stdin=subprocess.DEVNULL, stdout=errors, stderr=errors,
                )  # fmt: skip
        _write(folder / f"{self._jobs}.job", json.dumps([str(one) for one in arguments]))
        done, end = folder / f"{self._jobs}.done", time.monotonic() + timeout
        self._jobs += 1
        while not done.exists():
            if self._process.poll() is not None or time.monotonic() > end:
                self.close()
                raise RuntimeError(f"{self.number} ranks: {arguments}\n{(folder / 'stderr').read_text()}")
            time.sleep(_POLL)
        return done.read_text()

    def close(self) -> None:
        """End the ranks."""
        process, self._process = self._process, None
        if process is None:
            return
        _write(Path(self._folder.name) / f"{self._jobs}.job", "[]")
        try:
            process.wait(timeout=10.0)
        except subprocess.TimeoutExpired:
            process.terminate()
            process.wait()


def mpirun_command(ranks: int, threads: int = 1) -> list[str]:
    """Command that starts so many ranks of so many threads, also where there are fewer cores."""
    beside = Path(sys.executable).with_name("mpirun")  # of a wheel of MPI
    launcher = str(beside) if beside.exists() else "mpirun"
    command = [launcher, "-n", str(ranks)]
    if _is_open_mpi(launcher):
        # A bound rank has one core, and then no second thread; beside other tests, others are on these cores.
        alone = "PYTEST_XDIST_WORKER" not in os.environ
        bound = alone and threads == 1 and ranks <= len(os.sched_getaffinity(0))
        command += ["--oversubscribe", "--bind-to", "core" if bound else "none"]
    return command


def mpirun_environment(threads: int = 1) -> dict[str, str]:
    """Variables of ranks that share the cores with others.

    Threads and ranks that wait leave the core to those that work: four threads on two cores took fifteen times the
    processor time of the work itself.
    """
    waiting = {"OMP_WAIT_POLICY": "passive", "OMPI_MCA_mpi_yield_when_idle": "1"}
    return {**os.environ, "NUMBA_NUM_THREADS": str(threads), "OMP_NUM_THREADS": "1"} | waiting


def _is_open_mpi(launcher: str) -> bool:
    version = subprocess.run([launcher, "--version"], capture_output=True, text=True, check=False)
    return "Open MPI" in version.stdout or "open-mpi" in version.stdout.lower()


def _write(path: Path, text: str) -> None:
    """A file that is whole once it is there."""
    draft = path.with_suffix(".draft")
    draft.write_text(text)
    draft.rename(path)


def _serve(folder: Path) -> None:
    """Run what comes until an empty job; an error ends all ranks."""
    from mpi4py import MPI

    comm, number = MPI.COMM_WORLD, 0
    while True:
        job = folder / f"{number}.job"
        while not job.exists():
            time.sleep(_POLL)
        arguments = json.loads(job.read_text())
        if not arguments:
            return
        printed = io.StringIO()
        try:
            with redirect_stdout(printed):
                _run(*arguments)
        except BaseException:  # noqa: BLE001 - others wait for this rank: whatever it is, all end
            traceback.print_exc()
            sys.stderr.flush()
            comm.Abort(1)
        texts = comm.gather(printed.getvalue())
        if texts is not None:
            _write(folder / f"{number}.done", "".join(texts))
        number += 1


def _run(first: str, *rest: str) -> None:
    if first == "-m":
        sys.argv = [*rest]
        importlib.import_module(rest[0]).main()
    else:
        sys.argv = [first, *rest]
        runpy.run_path(first, run_name="__main__")


if __name__ == "__main__":
    _serve(Path(sys.argv[1]))
