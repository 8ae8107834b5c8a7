"""Peaks of memory of one piece of work.

`getrusage` has none: its peak is that of the process's whole life.
"""

from __future__ import annotations

from pathlib import Path

__all__ = ["peak_since_reset", "reset_peak"]


def reset_peak() -> None:
    """Begin a new peak of this process."""
    Path("/proc/self/clear_refs").write_text("5", encoding="ascii")


def peak_since_reset() -> int:
    """Largest resident memory of this process since `reset_peak`, bytes."""
    return _read(Path("/proc/self/status").read_text(encoding="ascii"), "VmHWM")


def _read(status: str, key: str) -> int:
    line = next(line for line in reversed(status.splitlines()) if line.startswith(f"{key}:"))
    return 1024 * int(line.split()[1])
