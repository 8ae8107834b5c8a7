"""Compiled kernels: how they call each other, and where they are kept: a folder of the user's own, or none.

Numba's cache holds pickles, which run code when they are read. A folder in which another user can write, or that
another user has made, is therefore never read.
"""

from __future__ import annotations

import hashlib
import importlib
import logging
import os
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import cache, wraps
from pathlib import Path
from typing import Any

from fragfield_base.cores import let_threads_sleep

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
    """The folder for compiled kernels: NUMBA_CACHE_DIR, else the user's cache.

    None, with a warning, where neither belongs to the user, or others can write to it.
    """
    home = os.environ.get("XDG_CACHE_HOME") or Path("~/.cache").expanduser()
    folder = Path(os.environ.get("NUMBA_CACHE_DIR") or Path(home) / "fragfield").absolute()
    with suppress(OSError):
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        found = folder.stat()
        if found.st_uid == os.geteuid() and not found.st_mode & 0o022 and os.access(folder, os.W_OK):
            return folder.resolve()
    _log.warning(
        "compiled kernels are not kept, which costs minutes in every command: %s cannot be written or others can write "
        "to it; give a folder that only you can write to by NUMBA_CACHE_DIR",
        folder,
    )
    return None
