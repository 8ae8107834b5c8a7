"""Whether an HDF5 file is sound, checked before the HDF5 library of this process opens it.

A file of this program is checked against its seal. One without a seal is looked at by another process first, which may
fail as it likes (`fragfield_base.probe`).
"""

from __future__ import annotations

import stat
import subprocess
from pathlib import Path

from fragfield_base.own_process import run_script
from fragfield_base.seal import SealError, check_seal

__all__ = ["check_sound"]

_sound: dict[str, tuple[int, int, int]] = {}  # files whose seal this process has checked, as they were then


def check_sound(path: Path, error: type[Exception], advice: str = "") -> None:
    """Refuse a file that is missing, no regular file, or not as it was sealed; `error` with one message."""
    end = f"; {advice}" if advice else ""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise error(f"{path}: not a file")
        before = _state(path)
        if _sound.get(str(path)) == before:
            return
        fault = _fault_of(path)
    except FileNotFoundError:
        raise error(f"{path}: no such file{end}") from None
    except OSError as found:
        raise error(f"{path}: cannot be read ({found.strerror or found}){end}") from None
    if fault is not None:
        raise error(f"{path}: {fault}{end}")
    _sound[str(path)] = before


def _state(path: Path) -> tuple[int, int, int]:
    found = path.stat()
    return found.st_ino, found.st_size, found.st_mtime_ns


def _fault_of(path: Path) -> str | None:
    try:
        with path.open("rb") as file:
            return None if check_seal(file) else _probed(path)
    except SealError as found:
        return f"damaged, cut off or changed since it was written: {found}"


def _probed(path: Path) -> str | None:
    """Have a process of its own look through a file that is not sealed; what is wrong with it."""
    try:
        done = run_script(Path(__file__).with_name("probe.py"), str(path), timeout=60)
    except subprocess.TimeoutExpired:
        return "cut off, or not an HDF5 file that can be read in a minute"
    if done.returncode == 0:
        return None
    words = done.stdout.decode("utf-8", "replace").strip().splitlines()
    return words[-1] if done.returncode == 1 and words else "cut off, or not an HDF5 file (reading it crashed)"
