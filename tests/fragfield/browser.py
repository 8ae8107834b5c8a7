"""Chromium without a window, as the tests of the pages need it."""

from __future__ import annotations

import re
import shutil
import subprocess
from pathlib import Path

import pytest

__all__ = ["needs_chromium", "open_page", "script_errors"]

needs_chromium = pytest.mark.skipif(shutil.which("chromium") is None, reason="needs chromium")

# No name resolves: a page that asked for anything outside itself would say so in the log.
_ALONE = ["--host-resolver-rules=MAP * ~NOTFOUND", "--disable-background-networking", "--no-first-run"]
_WORDS = re.compile(
    r"Uncaught|Unhandled|SyntaxError|TypeError|ReferenceError|Failed to load|ERR_|net::|WebGL.*fail", re.IGNORECASE
)


def open_page(page: Path, folder: Path, *options: str) -> subprocess.CompletedProcess[str]:
    """Open a page and return what chromium says; `folder` takes its profile."""
    command = [
        "chromium", "--headless", "--no-sandbox", "--enable-unsafe-swiftshader", "--enable-logging=stderr", *_ALONE,
        f"--user-data-dir={folder / 'profile'}", *options, page.as_uri(),
    ]  # fmt: skip
    return subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)


def script_errors(done: subprocess.CompletedProcess[str]) -> list[str]:
    """Errors of scripts and of missing parts that the page's console reported."""
    return [line for line in done.stderr.splitlines() if "CONSOLE" in line and _WORDS.search(line)]
