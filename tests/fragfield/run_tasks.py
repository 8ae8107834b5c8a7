"""What the processes of a study do in place of runs: functions that a new process can import."""

from __future__ import annotations

import os
import time
from pathlib import Path

__all__ = ["answer", "wait_for_interruption"]


def answer(request):
    """Print as C code does, then end the process as the request says, or answer with its number and its threads."""
    os.write(1, b"words\n")
    if "signal" in request:
        os.kill(os.getpid(), request["signal"])
    if "exit" in request:
        os._exit(request["exit"])
    return os.getpid(), f"{os.environ['NUMBA_NUM_THREADS']} {request['threads']}"


def wait_for_interruption(request):
    """Wait, as a burst that writes a checkpoint in its own time when it is interrupted."""
    out = request["out"]
    try:
        Path(f"{out}.begun").touch()
        time.sleep(60)
    except KeyboardInterrupt:
        time.sleep(0.5)
        Path(f"{out}.checkpoint").touch()
        return 130, "interrupted"
    return 0, ""
