"""Compiled kernels: how they call each other, and where they are kept: a folder of the user's own, or none.

Numba's cache holds pickles, which run code when they are read. A folder in which another user can write, or that
another user has made, is therefore never read. Looked at are the owner and the mode of the folder and of everything
above it.
"""

from __future__ import annotations

import hashlib
import importlib
import logging
import os
import stat
import tempfile
from contextlib import contextmanager, suppress
from functools import cache, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fragfield_base.cores import let_threads_sleep

if TYPE_CHECKING:
    from collections.abc import Callable, Iterable, Iterator


_log = logging.getLogger("fragfield.kernels")

# Every module of kernels imports this one before numba, whose threads read the environment once.
let_threads_sleep()


def digest_of(files: Iterable[Path]) -> str:
    """Names a state of source files and of how they are compiled: kernels of another one are not used."""
    how = (Path(__file__), Path(__file__).with_name("kernel_pipeline.py"))
    return hashlib.sha256(b"".join(path.read_bytes() for path in (*sorted(files), *how))).hexdigest()[:16]


def compiled_with(
    compiler: Any,  # noqa: ANN401
    function: Callable[..., Any],
    folder: str | None = None,
    **options: Any,
) -> Any:  # noqa: ANN401
    """Compile a function for calls from Python, and apart from that into every kernel that calls it.

    For kernels it is an overload in the sense of numba: without wrappers for Python, which take time to compile, and
    compiled once for all constants that it is called with. Its code is then part of theirs.

    Parameters
    ----------
    compiler : module
        numba.
    function : callable
        What is compiled.
    folder : str, optional
        Keep the machine code for calls from Python, where that is safe, in a folder of this name, which is that of a
        state of all sources. Numba's own key of a function is its source file alone, and would keep code that calls
        kernels since changed in others. Left out: nothing is kept, as of a function that kernels alone call.
    options
        Of numba.njit.

    Returns
    -------
    callable
        What is called from Python, and named by other kernels.
    """
    options = {"no_cfunc_wrapper": True, **options}
    compiled = _kept(compiler, function, folder, **options)
    if compiler.config.DISABLE_JIT:  # nothing is compiled
        return compiled

    @wraps(function)
    def kernel(*arguments: Any) -> Any:  # noqa: ANN401
        return compiled(*arguments)

    kernel.compiled = compiled  # type: ignore[attr-defined]
    overload = importlib.import_module("numba.extending").overload  # by name: only those who compile load numba
    pipeline = importlib.import_module("fragfield_base.kernel_pipeline").LinkedCompiler
    overload(kernel, jit_options={"pipeline_class": pipeline, **options}, strict=False)(lambda *_: function)
    return kernel


def _kept(compiler: Any, function: Callable[..., Any], folder: str | None, **options: Any) -> Any:  # noqa: ANN401
    root = None if folder is None else cache_root()
    if root is None or folder is None:
        return compiler.njit(**options)(function)
    with _cache_at(compiler, root / folder):
        try:
            return compiler.njit(cache=True, **options)(function)
        except RuntimeError:  # numba finds that it cannot write there after all
            return compiler.njit(**options)(function)


@contextmanager
def _cache_at(compiler: Any, folder: Path) -> Iterator[None]:  # noqa: ANN401 - numba stays unloaded here
    usual = compiler.config.CACHE_DIR
    compiler.config.CACHE_DIR = str(folder)
    try:
        yield
    finally:
        compiler.config.CACHE_DIR = usual


@cache
def cache_root() -> Path | None:
    """The folder for compiled kernels: NUMBA_CACHE_DIR, the user's cache, or one of the user's under the temporary.

    None, with a warning, where none of them belongs to the user alone.
    """
    candidates = []
    if given := os.environ.get("NUMBA_CACHE_DIR"):
        candidates.append(Path(given))
    if os.environ.get("XDG_CACHE_HOME", "").startswith("/"):  # its specification has a relative one ignored
        candidates.append(Path(os.environ["XDG_CACHE_HOME"]) / "fragfield")
    else:
        with suppress(RuntimeError):  # no home
            if Path.home().is_dir():
                candidates.append(Path.home() / ".cache/fragfield")
    candidates.append(Path(tempfile.gettempdir()) / f"fragfield-{os.geteuid()}")
    for folder in candidates:
        if _made(folder) and is_private(folder) and os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            return folder.resolve()
    _log.warning(
        "compiled kernels are not kept, which costs minutes in every command: %s; give a folder that only you can "
        "write to by NUMBA_CACHE_DIR",
        " and ".join(f"{folder} cannot be written or others can write to it" for folder in candidates),
    )
    return None


def is_private(folder: Path) -> bool:
    """Whether only the user and root can put something into a folder, or another folder in its place."""
    try:
        place = folder.resolve(strict=True)
        if place.stat().st_uid != os.geteuid() or not _closed(place, sticky=False):
            return False
        return all(above.stat().st_uid in (0, os.geteuid()) and _closed(above, sticky=True) for above in place.parents)
    except OSError:
        return False


def _made(folder: Path) -> bool:
    try:
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        if folder.stat().st_uid == os.geteuid() and folder.stat().st_mode & 0o022:
            folder.chmod(folder.stat().st_mode & ~0o022)
    except OSError:
        return folder.is_dir()
    return True


def _closed(folder: Path, *, sticky: bool) -> bool:
    """Whether others cannot change what a folder lists; with the sticky bit they cannot change what is not theirs."""
    found = folder.stat()
    if sticky and found.st_mode & stat.S_ISVTX:
        return True
    if found.st_mode & stat.S_IWOTH:
        return False
    return not found.st_mode & stat.S_IWGRP or _is_own_group(found.st_gid)


def _is_own_group(number: int) -> bool:
    """Whether a group is the user's alone, as many distributions make one for each."""
    import grp
    import pwd

    try:
        group, user = grp.getgrgid(number), pwd.getpwuid(os.geteuid())
    except KeyError:
        return False
    return group.gr_name == user.pw_name and set(group.gr_mem) <= {user.pw_name}
