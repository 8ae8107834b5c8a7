"""Whether VTK can draw without a window here, checked first because VTK would end the process."""

from __future__ import annotations

import ctypes
import os
import subprocess
import sys
from functools import cache

__all__ = [
    "PictureUnavailableError",
    "display_available",
    "failure",
    "go_untried",
    "library_fault",
    "offscreen_fault",
    "require_offscreen",
]

_WINDOWS = {
    "libEGL.so.1": "vtkEGLRenderWindow",
    "libOSMesa.so.8": "vtkOSOpenGLRenderWindow",
    "libOSMesa.so.6": "vtkOSOpenGLRenderWindow",
    "libOSMesa.so": "vtkOSOpenGLRenderWindow",
}
_CURE = "install libegl1 (Debian: apt-get install libegl1), then run `fragfield report` or `fragfield view` again"
# A driver may be missing behind a library that is there; VTK then dies by a signal, so that another process tries.
_TRIAL = (
    "import pyvista; p = pyvista.Plotter(off_screen=True, window_size=(16, 16)); p.add_mesh(pyvista.Sphere());"
    "p.screenshot(None, return_img=True); p.close()"
)

_untried = False


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


def library_fault() -> str | None:
    """Why VTK cannot draw off-screen for lack of a library, with the cure; None where there is one.

    VTK is pointed to the library; a driver behind it may still be missing.
    """
    library = next((name for name in _WINDOWS if _loadable(name)), None)
    if library is None:
        return f"VTK needs libEGL or libOSMesa to draw without a window, neither of which is installed; {_CURE}"
    if not display_available():
        # Otherwise VTK asks for an X server first, and complains that there is none.
        os.environ.setdefault("VTK_DEFAULT_OPENGL_WINDOW", _WINDOWS[library])
    return None


def failure(last: str) -> str:
    """The message for a process that VTK ended, with its last words."""
    return f"VTK fails to draw without a window here ({last}); {_CURE}"


def go_untried() -> None:
    """Draw without a trial from now on: another process notices where VTK ends this one."""
    global _untried  # noqa: PLW0603 - of the process, as its end would be
    _untried = True


@cache
def offscreen_fault() -> str | None:
    """Why VTK cannot draw off-screen here, with the cure; None when it can. Tried once a process."""
    if (fault := library_fault()) or _untried:
        return fault
    try:
        trial = subprocess.run([sys.executable, "-c", _TRIAL], capture_output=True, text=True, timeout=120, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        return f"VTK could not be tried: {error}"
    if trial.returncode == 0:
        return None
    return failure((trial.stderr.strip().splitlines() or [f"exit code {trial.returncode}"])[-1])


def require_offscreen() -> None:
    """Raise PictureUnavailableError where VTK cannot draw off-screen."""
    if fault := offscreen_fault():
        raise PictureUnavailableError(fault)
