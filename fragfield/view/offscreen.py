"""Drawing by VTK without a window, in a process beside: where a driver is missing VTK ends its process."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from contextlib import contextmanager
from typing import TYPE_CHECKING

from fragfield.errors import InputError

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator
    from pathlib import Path


_WINDOWS = {
    "libEGL.so.1": "vtkEGLRenderWindow",
    "libOSMesa.so.8": "vtkOSOpenGLRenderWindow",
    "libOSMesa.so.6": "vtkOSOpenGLRenderWindow",
    "libOSMesa.so": "vtkOSOpenGLRenderWindow",
}
_CURE = "install libegl1 (Debian: apt-get install libegl1), then run `fragfield report` or `fragfield view` again"
INPUT = 2
"""Exit code of the process where a file of the run is damaged, as of the command line."""


class PictureUnavailableError(RuntimeError):
    """No picture can be drawn on this machine; the message says why and what to install."""


def _loadable(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def _library() -> str | None:
    return next((name for name in _WINDOWS if _loadable(name)), None)


def offscreen_fault() -> str:
    """Why VTK cannot draw off-screen for lack of a library, with the cure; empty where there is one.

    A driver behind the library may still be missing.
    """
    if _library() is None:
        return f"VTK needs libEGL or libOSMesa to draw without a window, neither of which is installed; {_CURE}"
    return ""


def use_offscreen() -> None:
    """Point VTK, before it is loaded, to a library that needs no display, also where there is one or seems to be."""
    if (library := _library()) is not None:
        os.environ["VTK_DEFAULT_OPENGL_WINDOW"] = _WINDOWS[library]


@contextmanager
def drawing(run: Path, folder: Path, *, wide: bool) -> Iterator[Callable[[], str]]:
    """While it is entered the pictures of a run are drawn into a folder; what it gives waits for them.

    That function's result says why VTK draws none here; empty: they are there. It raises InputError where a file of
    the run is damaged, or the folder cannot be written.
    """
    if fault := offscreen_fault():
        yield lambda: fault
        return
    words = [sys.executable, "-m", "fragfield.view", str(run.absolute()), str(folder.absolute()), str(int(wide))]
    with subprocess.Popen(words, stdin=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True) as process:

        def finish() -> str:
            said = process.communicate()[1].strip().splitlines()
            last = said[-1] if said else f"exit code {process.returncode}"
            if process.returncode == INPUT:
                raise InputError(last)
            return f"VTK fails to draw without a window here ({last}); {_CURE}" if process.returncode else ""

        try:
            yield finish
        finally:
            process.kill()
