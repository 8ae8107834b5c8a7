"""Peaks of memory of one piece of work.

`getrusage` has none: its peak is that of the process's whole life, and that of a child begins with its parent's, whose
pages the child holds between fork and exec.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

__all__ = ["peak_of_script", "peak_since_reset", "reset_peak"]

_SCRIPT = """
import runpy, sys
del sys.argv[0]
try:
    runpy.run_path(sys.argv[0], run_name="__main__")
finally:
    with open("/proc/self/status", encoding="ascii") as status:
        sys.stderr.write(status.read())
"""


def reset_peak() -> None:
    """Begin a new peak of this process."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def peak_since_reset() -> int:
    """Largest resident memory of this process since `reset_peak`, bytes."""
    return _read(Path("/proc/self/status").read_text(encoding="ascii"), "VmHWM")


def peak_of_script(script: Path, *arguments: object) -> int:
    """Largest address space of a Python file that runs in a process of its own, bytes, with what is never touched."""
    command = [sys.executable, "-P", "-c", _SCRIPT, str(script), *map(str, arguments)]
    done = subprocess.run(command, capture_output=True, text=True, errors="replace", check=False)
    return _read(done.stderr, "VmPeak")


def _read(status: str, key: str) -> int:
    line = next(line for line in reversed(status.splitlines()) if line.startswith(f"{key}:"))
    return 1024 * int(line.split()[1])
