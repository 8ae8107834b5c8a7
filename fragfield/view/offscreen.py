"""Drawing by VTK without a window, in a process of its own.

Where a driver is missing VTK ends its process; whoever asked for a picture goes on and says so.
"""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from fragfield.errors import InputError

if TYPE_CHECKING:
    from types import TracebackType

__all__ = [
    "DONE",
    "INPUT",
    "UNAVAILABLE",
    "VIEWS",
    "PictureProcess",
    "PictureUnavailableError",
    "display_available",
    "offscreen_fault",
]

VIEWS = {"picture_of_burst": "view_burst.html", "picture_of_fragments": "view_fragments.html"}
"""Interactive page beside each picture."""
_WINDOWS = {
    "libEGL.so.1": "vtkEGLRenderWindow",
    "libOSMesa.so.8": "vtkOSOpenGLRenderWindow",
    "libOSMesa.so.6": "vtkOSOpenGLRenderWindow",
    "libOSMesa.so": "vtkOSOpenGLRenderWindow",
}
_CURE = "install libegl1 (Debian: apt-get install libegl1), then run `fragfield report` or `fragfield view` again"
_DRAW = "import sys; from fragfield.view.show import draw; sys.exit(draw(*sys.argv[1:]))"
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
    """Whether a window can be opened (X or Wayland)."""
    return bool(os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY"))


def offscreen_fault() -> str:
    """Why VTK cannot draw off-screen for lack of a library, with the cure; empty where there is one.

    VTK is pointed to the library; a driver behind it may still be missing.
    """
    library = next((name for name in _WINDOWS if _loadable(name)), None)
    if library is None:
        return f"VTK needs libEGL or libOSMesa to draw without a window, neither of which is installed; {_CURE}"
    if not display_available():
        # Otherwise VTK asks for an X server first, and complains that there is none.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", _WINDOWS[library])
    return ""


class PictureProcess:
    """A process that draws the pictures or pages of a run; a context manager, at whose end it has ended too.

    Parameters
    ----------
    run : Path
        The run directory.
    folder : Path
        Interactive pages go there, pictures into its folder `figures`.
    what : "report", "pictures" or "pages"
        Narrow pictures, and pages where trame-vtk is installed; wide pictures; pages.
    """

    def __init__(self, run: Path, folder: Path, what: str) -> None:
        self._fault = offscreen_fault()
        self._words = tempfile.TemporaryFile("w+", encoding="utf-8", errors="replace")  # noqa: SIM115 - see __exit__
        command = [sys.executable, "-c", "" if self._fault else _DRAW, str(run), str(folder), what]
        self._process = subprocess.Popen(command, stdin=subprocess.DEVNULL, stdout=self._words, stderr=self._words)

    def __enter__(self) -> PictureProcess:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        self._process.kill()
        self._process.wait()
        self._words.close()

    def finish(self) -> str:
        """Wait for the files; why VTK draws none here, or nothing.

        Raises
        ------
        InputError
            A file of the run is damaged, or a folder cannot be written.
        """
        code = self._process.wait()
        self._words.seek(0)
        words = self._words.read().strip()
        last = (words.splitlines() or [f"exit code {code}"])[-1]
        if code == INPUT:
            raise InputError(last)
        if code == FAULT:
            raise RuntimeError(f"pictures could not be drawn: {words}")
        if code == DONE:
            return self._fault
        return last if code == UNAVAILABLE else f"VTK fails to draw without a window here ({last}); {_CURE}"
