"""Cores that this process may use, and how its threads wait for each other.

Cores are those of the affinity and of the quota of the container. Numba's threads are those of OpenMP (GNU's libgomp),
which by default spin for milliseconds at the end of every shared loop before they sleep. On cores of their own that
saves waking them, some 10 us a loop. Where more threads than free cores run, they spin on the core that the last thread
needs, and a burst takes ten times as long or more: there they sleep.
"""

from __future__ import annotations

import os
import time
from contextlib import suppress
from functools import cache
from pathlib import Path, PurePosixPath

_GROUPS = Path("/proc/self/cgroup")
_MOUNTED = Path("/sys/fs/cgroup")
_NAMES = {"OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME"}
_LOCAL_RANKS = ("OMPI_COMM_WORLD_LOCAL_SIZE", "MPI_LOCALNRANKS", "SLURM_NTASKS_PER_NODE")
_LOOKS, _BETWEEN = 5, 5e-4  # s


def cores() -> int:
    """Cores that this process may use, at least 1.

    Those of its affinity (`taskset`, a batch system, `mpirun`), or fewer where a container has a quota of their time:
    a quota of 2.5 cores is 2, since threads that wait for each other lose more by being stopped than a half can give.
    """
    found = affinity()
    granted = quota()
    return found if granted is None else max(1, min(found, int(granted)))


def affinity() -> int:
    """Cores on which the system lets this process run."""
    with suppress(AttributeError):  # of Linux
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


@cache
def quota(groups: Path = _GROUPS, mounted: Path = _MOUNTED) -> float | None:
    """Cores' worth of time that control groups (`cpu.max`) grant, the lowest of this one's and those above it.

    None for no limit. A container that sees groups of its own names them from their root, one that does not from the
    host's: then only the root is there.
    """
    limits = []
    with suppress(OSError, UnicodeDecodeError):
        for line in groups.read_text(encoding="utf-8").splitlines():
            if not line.startswith("0::"):
                continue
            below = [part for part in PurePosixPath(line[3:]).parts if part not in ("/", "..")]
            for depth in range(len(below) + 1):
                with suppress(OSError, ValueError, ZeroDivisionError):
                    granted, period = mounted.joinpath(*below[:depth], "cpu.max").read_text(encoding="ascii").split()
                    limits += [] if granted == "max" else [int(granted) / int(period)]
    return min(limits, default=None)


def let_threads_sleep() -> None:
    """Set OMP_WAIT_POLICY to passive where cores are shared, unless the user has set how threads wait.

    Called where a run begins and before kernels are loaded. The library reads it when it is loaded, which `import
    dolfinx` does as well: what a caller has imported before keeps to what it found. Processes that this one starts
    inherit it.
    """
    if not _NAMES & set(os.environ) and _cores_are_shared():
        os.environ["OMP_WAIT_POLICY"] = "passive"


def _cores_are_shared() -> bool:
    """Whether the threads of this process, of the other ranks here and of other work are more than the cores."""
    available = cores()
    threads = _whole("NUMBA_NUM_THREADS") or _whole("OMP_NUM_THREADS") or available
    if affinity() < (os.cpu_count() or 1):  # bound to cores of its own, as ranks are
        return threads > available
    ranks = max(1, *(_whole(name) for name in _LOCAL_RANKS))
    return ranks * threads + max(_others_running() - (ranks - 1), 0) > available


def _whole(name: str) -> int:
    text = os.environ.get(name, "")
    return int(text) if text.isdecimal() else 0


def _others_running() -> int:
    """Threads of other work that run now: the median of a few looks; the load of the last minute where none can be had.

    The load would count work that has ended, after which a small burst would take up to twice as long for nothing.
    """
    looks = []
    with suppress(OSError, ValueError, IndexError):  # Linux: "0.20 0.18 0.12 1/80 11206", this thread among the running
        for _ in range(_LOOKS):
            looks.append(int(Path("/proc/loadavg").read_text(encoding="ascii").split()[3].partition("/")[0]) - 1)
            time.sleep(_BETWEEN)
        return sorted(looks)[_LOOKS // 2]
    with suppress(OSError, AttributeError):  # not on Windows
        return int(os.getloadavg()[0] + 0.5)
    return 0
