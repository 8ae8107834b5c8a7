"""Kernels that a first run compiles: those of the flight in a second process, while the first computes the burst."""

from __future__ import annotations

import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from fragfield.case import CaseTable
from fragfield.case.write import to_toml
from fragfield.terminal.progress import COMPILING
from fragfield_base.ambient import own_environment
from fragfield_base.cores import cores
from fragfield_base.kernel_cache import cache_root

_SECONDS = {"burst": 28, "flight": 30}
"""What compiling takes on one core of 2.5 GHz."""
_FRAGMENTS = "mass_kg,vx_m_s,vy_m_s,vz_m_s\n0.05,600,0,100\n0.02,0,700,50\n0.01,-800,0,200\n"


@contextmanager
def compiled_beside(case: CaseTable, *, quiet: bool) -> Iterator[Callable[[], object]]:
    """Compile the flight's kernels in another process where the cache has none; what is yielded waits for them.

    `quiet`: without a line on standard error on what is compiled and how long that takes.
    """
    missing = _missing()
    if missing and not quiet:
        seconds = [_SECONDS[name] for name in missing]
        about = max(seconds) if cores() > 1 else sum(seconds)
        sys.stderr.write(f"{' and '.join(missing)}: {COMPILING}, about {about} s\n")
    if missing != ["burst", "flight"] or cores() < 2:
        yield lambda: None
        return
    with tempfile.TemporaryDirectory(prefix="fragfield-", ignore_cleanup_errors=True) as folder:
        path, fragments = Path(folder) / "case.toml", Path(folder) / "fragments.csv"
        path.write_text(to_toml(case), encoding="utf-8")
        fragments.write_text(_FRAGMENTS, encoding="utf-8")
        command = [
            sys.executable,
            "-P",
            "-m",
            "fragfield",
            "fly",
            f"{path}",
            f"--fragments={fragments}",
            f"--out={folder}/run",
        ]
        process = subprocess.Popen(command, env=own_environment(), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        try:
            yield process.wait
        finally:
            process.terminate()
            process.wait()


def _missing() -> list[str]:
    """Stages of which no kernel is in the cache; none where nothing can be kept."""
    from burst_fenicsx.kernels import lanes
    from flight.kernels import compiling

    root = cache_root()
    folders = {"burst": lanes._FOLDER, "flight": f"flight-{compiling._STAMP}"}
    return [] if root is None else [name for name, one in folders.items() if not any((root / one).rglob("*.nbi"))]
