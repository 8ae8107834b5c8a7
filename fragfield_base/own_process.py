"""Runs a function in a separate process, where a file or a library may crash, hang or fill its reader.

Each begins as the command line does: free of its surroundings, see `fragfield_base.ambient`.
"""

from __future__ import annotations

import subprocess
import sys
from typing import Any

from fragfield_base.ambient import own_environment

__all__ = ["run_function", "start_function"]

_FOLDER = "/"


def start_function(module: str, name: str, *arguments: str, **streams: Any) -> subprocess.Popen[bytes]:
    """Start `sys.exit(module.name(*arguments))` by this interpreter; `streams` are Popen's, by default no input."""
    streams = {"stdin": subprocess.DEVNULL, **streams}
    return subprocess.Popen(_command(module, name, arguments), env=own_environment(), cwd=_FOLDER, **streams)


def run_function(
    module: str, name: str, *arguments: str, timeout: float | None = None
) -> subprocess.CompletedProcess[bytes]:
    """Run a function by this interpreter and wait for its end; its result is the exit code.

    Files among its arguments are absolute paths. Returned is what it wrote to its two streams; raises TimeoutExpired
    after `timeout` (s).
    """
    return subprocess.run(
        _command(module, name, arguments), stdin=subprocess.DEVNULL, capture_output=True, timeout=timeout,
        env=own_environment(), cwd=_FOLDER, check=False,
    )  # fmt: skip


def _command(module: str, name: str, arguments: tuple[str, ...]) -> list[str]:
    code = (
        "import sys; arguments = sys.argv[1:]; sys.argv[1:] = []; "
        "from fragfield_base.ambient import settle; settle(RuntimeError); "
        f"from {module} import {name}; sys.exit({name}(*arguments))"
    )
    return [sys.executable, "-P", *(["-s"] if sys.flags.no_user_site else []), "-c", code, *arguments]
