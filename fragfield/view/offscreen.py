"""Drawing by VTK without a window, in a process of its own.

Where a driver is missing VTK ends its process; whoever asked for a picture goes on and says so.
"""

from __future__ import annotations

import ctypes
import json
import os
import subprocess
import sys
import tempfile
from contextlib import suppress
from functools import cached_property
from typing import TYPE_CHECKING

from fragfield.errors import InputError
from fragfield_base.ambient import start_function

if TYPE_CHECKING:
    from pathlib import Path
    from types import TracebackType


VIEWS = {"picture_of_burst": "view_burst.html", "picture_of_fragments": "view_fragments.html"}
"""Interactive page beside each picture."""
_WINDOWS = {
    "libEGL.so.1": "vtkEGLRenderWindow",
    "libOSMesa.so.8": "vtkOSOpenGLRenderWindow",
    "libOSMesa.so.6": "vtkOSOpenGLRenderWindow",
    "libOSMesa.so": "vtkOSOpenGLRenderWindow",
}
_CURE = "install libegl1 (Debian: apt-get install libegl1), then run `fragfield report` or `fragfield view` again"
DONE, FAULT, INPUT, UNAVAILABLE = 0, 1, 2, 3


class PictureUnavailableError(RuntimeError):
    """No picture can be drawn on this machine; the message says why and what to install."""


def _loadable(name: str) -> bool:
    try:
        ctypes.CDLL(name)
    except OSError:
        return False
    return True


def display_available() -> bool:
    """Whether a window can be opened: an X server answers and lets this user in (VTK asks no other on Linux).

    The variable DISPLAY alone says little: it outlives its server, in `screen` and batch jobs for one.
    """
    if sys.platform == "darwin":
        return True
    if not os.environ.get("DISPLAY"):
        return False
    try:
        library = ctypes.CDLL("libX11.so.6")
    except OSError:
        return False
    library.XOpenDisplay.restype, library.XCloseDisplay.argtypes = ctypes.c_void_p, [ctypes.c_void_p]
    if (display := library.XOpenDisplay(None)) is None:
        return False
    library.XCloseDisplay(display)
    return True


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


def _library() -> str | None:
    return next((name for name in _WINDOWS if _loadable(name)), None)


class PictureProcess:
    """A process that draws the pictures or pages of a run; a context manager, at whose end it has ended too.

    Parameters
    ----------
    run : Path
        The run directory.
    folder : Path
        Interactive pages go there, pictures into its folder `figures`.
    what : "run", "report", "pictures" or "pages"
        Narrow pictures, and pages where trame-vtk is installed; wide pictures; pages. For a run as for its report, with
        the report's figures: the process loads its libraries, and waits for `go_on` after each stage.
    """

    def __init__(self, run: Path, folder: Path, what: str) -> None:
        self._fault, self._waits = offscreen_fault(), what == "run"
        drawn, words = (tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace") for _ in range(2))  # noqa: SIM115
        self._drawn, self._words = drawn, words  # closed by __exit__
        places = [str(place.absolute()) for place in (run, folder)]
        self._process = None if self._fault else start_function(
            "fragfield.view.show", "draw", *places, what, stdin=subprocess.PIPE, stdout=drawn, stderr=words
        )  # fmt: skip

    def go_on(self, stage: str) -> None:
        """Let the process of a run draw what a stage has computed."""
        if self._process is not None and self._process.stdin is not None:
            with suppress(OSError):  # it has ended
                self._process.stdin.write(f"{stage}\n".encode())
                self._process.stdin.flush()

    @cached_property
    def figures(self) -> dict[str, bytes | None]:
        """Figures (SVG) of the report by name, None of those without data, once a run's are drawn; else none."""
        if self._process is not None and self._waits:
            self._end(self._process)
            self._drawn.seek(0)
            with suppress(ValueError):  # it did not come so far
                return {name: None if text is None else text.encode() for name, text in json.load(self._drawn).items()}
        return {}

    @staticmethod
    def _end(process: subprocess.Popen[bytes]) -> int:
        """Wait for the end of a process that gets no further stage; its exit code."""
        with suppress(OSError):
            if process.stdin is not None:
                process.stdin.close()
        return process.wait()

    def __enter__(self) -> PictureProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        if self._process is not None:
            self._process.kill()
            self._process.communicate()
        self._drawn.close()
        self._words.close()

    def finish(self) -> str:
        """Wait for the files; why VTK draws none here, or nothing.

        Raises InputError: a file of the run is damaged, or a folder cannot be written.
        """
        if self._process is None:
            return self._fault
        code = self._end(self._process)
        self._words.seek(0)
        words = self._words.read().strip()
        last = (words.splitlines() or [f"exit code {code}"])[-1]
        if code == INPUT:
            raise InputError(last)
        if code == FAULT:
            raise RuntimeError(f"pictures could not be drawn: {words}")
        if code == DONE:
            return ""
        return last if code == UNAVAILABLE else f"VTK fails to draw without a window here ({last}); {_CURE}"
