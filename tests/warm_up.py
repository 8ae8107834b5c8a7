"""`python -m tests.warm_up WORKERS`: compile the kernels once, before tests run side by side.

Processes that start together would each compile the same kernels, and numba's cache cannot be written by several of
them: it numbers the files of a function's signatures by what it finds there. So the kernels of default runs are
compiled first (`fragfield warm-up`); then every worker of pytest-xdist gets a cache of its own, which begins with links
to what is there. What the workers have compiled besides is taken into the common cache before the next run.
"""

from __future__ import annotations

import os
import pickle
import shutil
import subprocess
import sys
import time
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from numba.core.serialize import dumps

from fragfield.studies.warm_up import warm_up
from fragfield_base.kernel_cache import cache_root

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

__all__ = ["CURRENT", "folder_of", "gather", "link"]

CURRENT = """
from burst_fenicsx.kernels import lanes
from flight.kernels import compiling as flight
from transition.kernels import compiling as transition
print(lanes._FOLDER)
print(f"flight-{flight._STAMP} transition-{transition._STAMP}")
"""


def folder_of(root: Path, worker: str) -> Path:
    """Cache of a worker ("gw0", ...)."""
    return root / "workers" / worker


def link(root: Path, folder: Path, names: Iterable[str]) -> None:
    """Begin a worker's cache again, with links to the files of the folders `names` of the common one."""
    shutil.rmtree(folder, ignore_errors=True)
    for path in [path for name in names for path in (root / name).rglob("*.nb?")]:
        place = folder / path.relative_to(root)
        place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
        os.link(path, place)


def gather(root: Path, folder: Path, names: Iterable[str]) -> int:
    """Take over the code of functions that a worker has compiled and the common cache does not know; how much it was.

    Code is known by its function and its types of arguments: a worker may have compiled a function of the common cache
    for other types.
    """
    return sum(
        _join(index, root / index.relative_to(folder)) for name in names for index in (folder / name).rglob("*.nbi")
    )


def _join(index: Path, common: Path) -> int:
    """Add what a worker's index names to the common one, its code under numbers that are free there."""
    if common.exists() and common.samefile(index):
        return 0
    version, stamp, compiled = _read(index)
    known: dict[Any, str] = {}
    if common.exists():
        common_version, common_stamp, ours = _read(common)
        # numba takes an index of another version or source for an empty one.
        known = ours if (common_version, common_stamp) == (version, stamp) else {}
    missing = {key: name for key, name in compiled.items() if key not in known}
    common.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    for key, name in missing.items():
        known[key] = next(free for free in _names(index.stem) if free not in known.values())
        shutil.copy2(index.parent / name, common.parent / known[key])
    if missing:
        new = common.with_suffix(".new")
        new.write_bytes(pickle.dumps(version) + dumps((stamp, known)))
        new.replace(common)
    return len(missing)


def _names(stem: str) -> Iterator[str]:
    """Names of files of code as numba gives them."""
    return (f"{stem}.{number}.nbc" for number in count(1))


def _read(index: Path) -> tuple[str, Any, dict[Any, str]]:
    """Version of numba, stamp of the source, and the file of each signature's code."""
    with index.open("rb") as file:
        return (pickle.load(file), *pickle.loads(file.read()))


def main() -> None:
    """Compile, take over and link."""
    workers = [f"gw{number}" for number in range(int(sys.argv[1]))]
    root = cache_root()
    if root is None:
        return
    began = time.monotonic()
    command = [sys.executable, "-c", CURRENT]
    names = subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()
    taken = sum(gather(root, folder_of(root, worker), names) for worker in workers)
    failures = warm_up()["failures"]
    for worker in workers:
        link(root, folder_of(root, worker), names)
    print(f"kernels: {taken} taken over, {time.monotonic() - began:.0f} s", *failures, flush=True)


if __name__ == "__main__":
    main()
