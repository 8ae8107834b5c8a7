"""Public names of a package whose modules are loaded when a name is first used: most commands need few of them."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazy_names(package: str, homes: Mapping[str, str]) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """`__getattr__` and `__dir__` of a package.

    `homes` has the names, with spaces between them, that each module is the home of; no name: the module itself. A
    public name must not be that of a module of the package, which would take its place once it is loaded.
    """
    home = {name: module for module, names in homes.items() for name in names.split() or [module.rpartition(".")[2]]}

    def get(name: str) -> Any:  # noqa: ANN401 - what is asked for
        if name not in home:
            raise AttributeError(f"module {package!r} has no attribute {name!r}")
        module = import_module(home[name])
        return getattr(module, name) if homes[home[name]] else module

    def names() -> list[str]:
        return sorted({*vars(sys.modules[package]), *home})

    return get, names
