"""Cores that this process may use: by its affinity, and by the quota of its container."""

from __future__ import annotations

import os
from contextlib import suppress
from functools import cache
from pathlib import Path, PurePosixPath

__all__ = ["affinity", "cores", "quota"]

_GROUPS = Path("/proc/self/cgroup")
_MOUNTED = Path("/sys/fs/cgroup")


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
    """Cores' worth of time that control groups grant, the lowest of this one's and those above it; None for no limit.

    Both versions: `cpu.max` of the second, `cpu.cfs_quota_us` beside `cpu.cfs_period_us` of the first. A container that
    sees groups of its own names them from their root, one that does not from the host's: then only the root is there.
    """
    limits = []
    with suppress(OSError, UnicodeDecodeError):
        for line in groups.read_text(encoding="utf-8").splitlines():
            number, _, rest = line.partition(":")
            names, _, own = rest.partition(":")
            if number == "0" and not names:
                roots = [mounted, mounted / "unified"]
            elif "cpu" in names.split(","):
                roots = [mounted / names, mounted / "cpu"]
            else:
                continue
            below = [part for part in PurePosixPath(own).parts if part not in ("/", "..")]
            folders = [root.joinpath(*below[:depth]) for root in roots for depth in range(len(below) + 1)]
            limits += [limit for folder in folders if (limit := _limit(folder)) is not None]
    return min(limits, default=None)


def _limit(folder: Path) -> float | None:
    """Cores' worth of time that one group grants."""
    with suppress(OSError, ValueError, ZeroDivisionError):
        granted, period = (folder / "cpu.max").read_text(encoding="ascii").split()
        return None if granted == "max" else int(granted) / int(period)
    with suppress(OSError, ValueError, ZeroDivisionError):
        granted = (folder / "cpu.cfs_quota_us").read_text(encoding="ascii")
        period = (folder / "cpu.cfs_period_us").read_text(encoding="ascii")
        return None if int(granted) <= 0 else int(granted) / int(period)
    return None
