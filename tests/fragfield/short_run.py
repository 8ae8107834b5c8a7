"""A short run of the ready tube: how it is started, and how two of its files are compared."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from click.testing import Result
from typer.testing import CliRunner

from fragfield.cli import app

__all__ = ["RINGS", "ROOT", "SHORT", "command", "environment", "invoke", "python"]

ROOT = Path(__file__).parents[2]
# The first 12 us of the ready tube with four cells around the wall: seconds, and every stage has something to do. In
# three dimensions, which every arrangement has; its meridian is `RINGS`. Eight realisations; the flight adds none.
SHORT = (ROOT / "cases" / "tube.toml").read_text().replace(
    'end_time = "120 us"', 'end_time = "12 us"\nenergy_tolerance = 1.0\noutput = { interval = "4 us" }'
).replace('cell_size = "6 mm"', 'cell_size = "12 mm"\ngeometry = "3d"').replace(
    "[break_up]", "[hazard]\ntolerance = 0.5\nmax_realisations = 8\n\n[break_up]\nrealisations = 8"
)  # fmt: skip
RINGS = SHORT.replace('geometry = "3d"\n', "")


def invoke(*arguments: object) -> Result:
    """Call the command line in this process."""
    return CliRunner().invoke(app, [str(argument) for argument in arguments])


def command(*arguments: object) -> list[str]:
    """The command line for a separate process, which needs `environment`."""
    return [sys.executable, "-m", "fragfield", *map(str, arguments)]


def python(script: str) -> subprocess.CompletedProcess[str]:
    """A script in a process of its own."""
    words = [sys.executable, "-c", script]
    return subprocess.run(words, capture_output=True, text=True, env=environment(), timeout=120, check=False)


def environment() -> dict[str, str]:
    """Variables with which another process finds these packages; beside other tests it takes one thread."""
    threads = {"NUMBA_NUM_THREADS": "1"} if "PYTEST_XDIST_WORKER" in os.environ else {}
    return {**os.environ, **threads, "PYTHONPATH": str(ROOT)}
