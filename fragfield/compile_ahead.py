"""The kernels of a run compiled before it begins, side by side, where this machine has not compiled them yet.

`kernel_lists/NAME.json` has what each stage of a default run needs; `python -m tests.kernel_lists` records them. What
no list has is compiled where it is called.
"""

from __future__ import annotations

import fcntl
import hashlib
import importlib
import json
import logging
import os
import sys
import time
from contextlib import contextmanager, suppress
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield_base.kernel_cache import cache_root
from fragfield_base.kernel_workers import compile_side_by_side

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator, Sequence

__all__ = ["FOLDER", "MARKS", "compile_ahead", "list_of", "merged"]

FOLDER = Path(__file__).with_name("kernel_lists")
MARKS = "compiled"
"""Folder of the cache with an empty file for each list that has been compiled."""
_log = logging.getLogger("fragfield.kernels")
_POLL = 0.2  # s between two looks whether another command has done with compiling


def list_of(stage: str, geometry: str) -> Path:
    """File that lists what a stage needs; `geometry` is that of the burst, "3d" or "axisymmetric"."""
    return FOLDER / f"{stage}_{geometry}.json"


def compile_ahead(lists: Sequence[Path], cores: int, show: Callable[[int, int], object]) -> int:
    """Compile the kernels of lists, unless they have been compiled here before.

    Parameters
    ----------
    lists : sequence of Path
        Files, from `list_of`; those that are missing have nothing to compile.
    cores : int
        Processes at most.
    show : callable
        Called with the numbers of kernels done and in all; (0, 0) while another command compiles.

    Returns
    -------
    int
        Number of kernels compiled or found in the cache; 0 where there was nothing to do, or no cache.
    """
    root = cache_root()
    if root is None or _not_compiled():
        return 0
    folder = root / MARKS
    texts = {folder / _key(text): text for path in lists if path.is_file() for text in [path.read_text("utf-8")]}
    if all(mark.is_file() for mark in texts):
        return 0
    with _alone(folder, lambda: show(0, 0)):
        new = {mark: text for mark, text in texts.items() if not mark.is_file()}
        kernels = merged(new.values())
        if not kernels:
            return 0
        began = time.perf_counter()
        show(0, len(kernels))
        compiled = compile_side_by_side(kernels, cores, lambda done: show(done, len(kernels)))
        _log.info("kernels: %d of %d compiled in %.0f s", compiled, len(kernels), time.perf_counter() - began)
        if compiled == len(kernels):
            with suppress(OSError):
                for mark in new:
                    mark.touch()
        return compiled


def _not_compiled() -> bool:
    """Whether numba leaves kernels to the interpreter, as its setting says."""
    return bool(importlib.import_module("numba").config.DISABLE_JIT)


def merged(texts: Iterable[str]) -> list[dict[str, Any]]:
    """The kernels of all lists, each once with all its signatures: one process may write what is kept of it."""
    found: dict[str, dict[str, Any]] = {}
    for text in texts:
        for kernel in json.loads(text):
            known = found.setdefault(kernel["kernel"], {**kernel, "arguments": []})
            known["arguments"] += [one for one in kernel["arguments"] if one not in known["arguments"]]
    return list(found.values())


def _key(text: str) -> str:
    """Names a list, the sources of its kernels, processor and compiler.

    Numba keeps what it compiles under the path of a source and its time: those of another checkout are others.
    """
    folders = {tuple(kernel["kernel"].split(".")[:-2]) for kernel in json.loads(text)}
    sources = sorted(path for parts in folders for path in _folder_of(*parts).glob("*.py"))
    numba, target = importlib.import_module("numba"), importlib.import_module("numba.core.registry").cpu_target
    digest = hashlib.sha256(repr((numba.__version__, target.target_context.codegen().magic_tuple())).encode())
    digest.update(text.encode())
    for path in sources:
        digest.update(f"{path} {path.stat().st_mtime_ns}".encode() + path.read_bytes())
    return digest.hexdigest()[:16]


def _folder_of(package: str, *inner: str) -> Path:
    """Folder of a package, which is not imported."""
    spec = find_spec(package)
    return Path(spec.origin).parent.joinpath(*inner) if spec is not None and spec.origin else FOLDER


@contextmanager
def _alone(folder: Path, waits: Callable[[], object]) -> Iterator[None]:
    """While no other command compiles ahead; `waits` is called now and then till then."""
    try:
        folder.mkdir(mode=0o700, exist_ok=True)
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError:  # a full disk: nothing is kept, and no command waits for it
        yield
        return
    try:
        while not _taken(descriptor):
            waits()
            time.sleep(_POLL)
        yield
    finally:
        os.close(descriptor)


def _taken(descriptor: int) -> bool:
    """Whether the lock is ours; on a file system without locks as well, where commands may compile the same twice."""
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:
        pass
    return True


def main() -> int:
    """`python -m fragfield.compile_ahead GEOMETRY`: compile what `fragfield run` needs for a burst in this geometry."""
    cores = len(os.sched_getaffinity(0))
    compile_ahead([list_of(stage, sys.argv[1]) for stage in ("burst", "break-up", "fly")], cores, lambda *_: None)
    return 0


if __name__ == "__main__":
    sys.exit(main())
