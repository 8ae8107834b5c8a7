"""Folders that are made once for all processes of pytest-xdist, by the first that needs them."""

from __future__ import annotations

import fcntl
import os
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from collections.abc import Callable

    import pytest

__all__ = ["made_once"]


def made_once(factory: pytest.TempPathFactory, name: str, make: Callable[[Path], object]) -> Path:
    """A folder that `make` fills, which no test may change; another process waits while it is made.

    Parameters
    ----------
    factory : pytest.TempPathFactory
        Of the session; the workers' folders lie in one.
    name : str
        Of the folder, by which processes know it.
    make : callable
        Gets an empty folder. If it fails, the next process that needs the folder tries again.
    """
    base = factory.getbasetemp()
    root = base.parent if "PYTEST_XDIST_WORKER" in os.environ else base
    folder, made = root / f"shared_{name}", root / f"shared_{name}.made"
    with (root / f"shared_{name}.lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not made.exists():
            folder.mkdir(exist_ok=True)
            make(folder)
            made.touch()
    return folder
