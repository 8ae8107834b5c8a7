"""Compiled kernels of tests side by side: a cache for each worker, which begins with what all have compiled before.

Numba's cache cannot be written by several processes: it numbers the files of a function's signatures by what it finds
there. So the kernels of default runs are compiled first (`fragfield warm-up`), and every worker of pytest-xdist gets a
cache of its own. When tests begin, what the workers have compiled before is taken into the common cache, and each
worker gets links to all that is there.
"""

from __future__ import annotations

import os
import pickle
import shutil
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield_base.kernel_cache import cache_root

if TYPE_CHECKING:
    from collections.abc import Iterable, Iterator

__all__ = ["folder_of", "folders", "gather", "link", "share"]

ROOT = Path(__file__).resolve().parents[1]
PACKAGES = ("burst_fenicsx", "flight", "transition")


def share(workers: Iterable[str]) -> None:
    """Gather what workers ("gw0", ...) have compiled, and give all of it to each."""
    root, workers = cache_root(), list(workers)
    if root is not None and workers:
        names, places = folders(), [folder_of(root, worker) for worker in workers]
        for place in places:
            gather(root, place, names)
        for place in places:
            link(root, place, names)


def folder_of(root: Path, worker: str) -> Path:
    """Cache of a worker."""
    return root / "workers" / worker


def folders() -> list[str]:
    """Folders of a cache in which the kernels of these sources are kept now; others belong to other trees."""
    from numba.core.caching import _CacheLocator

    from burst_fenicsx.kernels import lanes
    from flight.kernels import compiling as flight
    from transition import kernels as transition

    states = (lanes._FOLDER, f"flight-{flight._STAMP}", f"transition-{transition._STAMP}")
    sources = {path.parent for name in PACKAGES for path in (ROOT / name).rglob("*.py")}
    modules = [_CacheLocator.get_suitable_cache_subpath(str(folder / "kernel.py")) for folder in sources]
    return [f"{state}/{module}" for state in states for module in modules]


def link(root: Path, folder: Path, names: Iterable[str]) -> None:
    """Begin the folders `names` of a worker's cache again, with links to the files of the common one."""
    for name in names:
        shutil.rmtree(folder / name, ignore_errors=True)
        for path in (root / name).glob("*.nb?"):
            place = folder / name / path.name
            place.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
            os.link(path, place)


def gather(root: Path, folder: Path, names: Iterable[str]) -> None:
    """Take over the code of functions that a worker has compiled and the common cache does not know.

    Code is known by its function and its types of arguments: a worker may have compiled a function of the common cache
    for other types.
    """
    for index in (index for name in names for index in (folder / name).glob("*.nbi")):
        _join(index, root / index.relative_to(folder))


def _join(index: Path, common: Path) -> None:
    """Add what a worker's index names to the common one, its code under numbers that are free there."""
    if common.exists() and common.samefile(index):
        return
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
        from numba.core.serialize import dumps

        new = common.with_suffix(".new")
        new.write_bytes(pickle.dumps(version) + dumps((stamp, known)))
        new.replace(common)


def _names(stem: str) -> Iterator[str]:
    """Names of files of code as numba gives them."""
    return (f"{stem}.{number}.nbc" for number in count(1))


def _read(index: Path) -> tuple[str, Any, dict[Any, str]]:
    """Version of numba, stamp of the source, and the file of each signature's code."""
    with index.open("rb") as file:
        return (pickle.load(file), *pickle.loads(file.read()))
