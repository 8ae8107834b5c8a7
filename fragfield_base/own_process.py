"""Runs a script in a separate process, where a file of unknown origin may crash, hang or fill its reader."""

from __future__ import annotations

import os
import subprocess
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

__all__ = ["run_script"]

_LAUNCHERS = ("OMPI_", "PMI_", "PMIX_", "SLURM_", "PRTE_", "MPI_")


def run_script(script: Path, *arguments: str, timeout: float | None = None) -> subprocess.CompletedProcess[bytes]:
    """Run a Python file with this interpreter and wait for its end.

    Parameters
    ----------
    script : Path
        What runs; its folder is no place of modules.
    arguments : str
        Its arguments.
    timeout : float, optional
        Seconds after which it is ended.

    Returns
    -------
    subprocess.CompletedProcess
        With what it wrote to its two streams.

    Raises
    ------
    subprocess.TimeoutExpired
        It ran longer.
    """
    # A launcher's variables would make MPI start in the child.
    environment = {key: value for key, value in os.environ.items() if not key.startswith(_LAUNCHERS)}
    command = [sys.executable, "-P", str(script), *arguments]
    return subprocess.run(
        command, stdin=subprocess.DEVNULL, capture_output=True, timeout=timeout, env=environment, check=False
    )
