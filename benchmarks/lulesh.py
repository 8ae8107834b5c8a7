"""LULESH 2.0, where its binary is at hand: a well-known explicit code with a gas law, to set the step beside."""

from __future__ import annotations

import os
import re
import subprocess
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["grind_time"]

_SIZE, _CYCLES, _SECONDS = 45, 150, 300.0
_GRIND = re.compile(r"Grind time \(us/z/c\)\s*=\s*([\d.eE+-]+) \(per dom\)")


def grind_time(binary: Path) -> float:
    """Seconds per cell and step of LULESH on one thread, 45^3 cells, by its own clock.

    Raises
    ------
    RuntimeError
        The binary does not run, or does not print what LULESH prints.
    """
    command = [str(binary.resolve()), "-s", str(_SIZE), "-i", str(_CYCLES)]
    environment = {**os.environ, "OMP_NUM_THREADS": "1"}
    try:
        done = subprocess.run(command, env=environment, capture_output=True, text=True, timeout=_SECONDS, check=True)
    except (OSError, subprocess.SubprocessError) as error:
        raise RuntimeError(f"{binary} does not run as LULESH: {error}") from None
    return parsed(done.stdout)


def parsed(output: str) -> float:
    """Grind time (s) of one domain from what LULESH printed."""
    found = _GRIND.search(output)
    if found is None:
        raise RuntimeError('no line "Grind time (us/z/c) = ... (per dom)": is this LULESH 2.0?')
    return 1e-6 * float(found[1])
