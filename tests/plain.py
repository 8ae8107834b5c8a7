"""Kernels as plain Python: a part of them is tried by hand without being compiled for calls from Python."""

from __future__ import annotations

import importlib
import pkgutil
import sys
from types import SimpleNamespace

import numba

__all__ = ["plain"]


def plain(package: str) -> SimpleNamespace:
    """The modules of a package of kernels by their names, loaded once more with the compiler switched off."""

    def take() -> dict[str, object]:
        return {name: sys.modules.pop(name) for name in list(sys.modules) if f"{name}.".startswith(f"{package}.")}

    folder = importlib.import_module(package)
    usual, switch = take(), numba.config.DISABLE_JIT
    numba.config.DISABLE_JIT = True
    try:
        names = [one.name for one in pkgutil.iter_modules(folder.__path__)]
        return SimpleNamespace(**{name: importlib.import_module(f"{package}.{name}") for name in names})
    finally:
        numba.config.DISABLE_JIT = switch
        take()
        sys.modules.update(usual)
        above, _, name = package.rpartition(".")
        setattr(sys.modules[above], name, folder)
