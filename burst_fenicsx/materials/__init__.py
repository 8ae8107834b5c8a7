"""Material laws: strength of solids and pressure of products, one module a law, found by its file.

A law is a module in the folder `solids` or `products`, whose pages say what it offers, or one elsewhere that is
registered. Which laws there are is settled when the kernels are imported, which are compiled for all of them.
"""

from __future__ import annotations

import sys
from functools import cache
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from types import ModuleType

__all__ = ["laws", "register", "registered_files"]

Kind = Literal["solids", "products"]

_registered: list[tuple[Kind, str]] = []


def register(kind: Kind, module: str) -> None:
    """Add the law in a module, given by its name, that is not imported yet.

    Raises
    ------
    RuntimeError
        The kernels are imported already.
    """
    if "burst_fenicsx.kernels.lanes" in sys.modules:
        raise RuntimeError(f"{module} is registered too late: the kernels are imported already")
    _registered.append((kind, module))


@cache
def laws(kind: Kind) -> tuple[ModuleType, ...]:
    """Modules of all laws of a kind; a law's place among them is its number in the kernels."""
    own = sorted(path.stem for path in Path(__file__).with_name(kind).glob("[!_]*.py"))
    names = [f"{__name__}.{kind}.{name}" for name in own]
    return tuple(import_module(name) for name in [*names, *(name for of, name in _registered if of == kind)])


def registered_files() -> list[Path]:
    """Source files of the laws that are registered: kernels compiled with them are no others'."""
    specs = [find_spec(name) for _, name in _registered]
    return [Path(spec.origin) for spec in specs if spec is not None and spec.origin is not None]
