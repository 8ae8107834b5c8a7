"""`python -m tests.warm_up WORKERS`: compile the kernels once, before tests run side by side.

Processes that start together would each compile the same kernels, and numba's cache cannot be written by several of
them: it numbers the files of a function's signatures by what it finds there. So the kernels of default runs are
compiled first, one on each core; then every worker of pytest-xdist gets a cache of its own, which begins with links to
what is there. What the workers have compiled besides is taken into the common cache before the next run.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import time
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.compile_ahead import FOLDER, MARKS, compile_ahead
from fragfield_base.kernel_cache import cache_root

if TYPE_CHECKING:
    from collections.abc import Iterable

__all__ = ["folder_of", "gather", "link"]

_CURRENT = """
from burst_fenicsx.kernels import lanes
from flight.kernels import compiling as flight
from transition.kernels import compiling as transition
print(f"burst-{lanes._SOURCES} burst-{lanes._AXISYMMETRIC_SOURCES}")
print(f"flight-{flight._STAMP} transition-{transition._STAMP}")
"""


def folder_of(root: Path, worker: str) -> Path:
    """Cache of a worker ("gw0", ...)."""
    return root / "workers" / worker


def link(root: Path, folder: Path, names: Iterable[str]) -> None:
    """Begin a worker's cache again, with links to the files of the folders `names` of the common one.

    What has been compiled ahead is known to be there.
    """
    shutil.rmtree(folder, ignore_errors=True)
    kept = [path for name in names for path in (root / name).rglob("*.nb?")]
    for path in (*kept, *(root / MARKS).glob("*")):
        place = folder / path.relative_to(root)
        place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        os.link(path, place)


def gather(root: Path, folder: Path, names: Iterable[str]) -> int:
    """Take over the functions that a worker has compiled and the common cache does not know; how many there were.

    A function's index and the code that it names are moved together: two indices cannot be joined.
    """
    found = 0
    for name in names:
        for index in (folder / name).rglob("*.nbi"):
            place = root / index.relative_to(folder)
            if place.exists():
                continue
            place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            for code in index.parent.glob(f"{index.stem}.*.nbc"):
                shutil.copy2(code, place.parent / code.name)
            shutil.copy2(index, place)
            found += 1
    return found


def main() -> None:
    """Compile, take over and link."""
    workers = [f"gw{number}" for number in range(int(sys.argv[1]))]
    root = cache_root()
    if root is None:
        return
    began = time.monotonic()
    command = [sys.executable, "-c", _CURRENT]
    names = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    taken = sum(gather(root, folder_of(root, worker), names) for worker in workers)
    compiled = compile_ahead(sorted(FOLDER.glob("*.json")), len(workers), lambda *_: None)
    for worker in workers:
        link(root, folder_of(root, worker), names)
    print(f"kernels: {compiled} compiled, {taken} taken over, {time.monotonic() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main()
