"""Lists of kernels with the types they are compiled for, as text: which ones a run needs is known before it runs.

A list is a JSON file of objects with the keys "kernel" (module and name), "arguments" (each signature's types) and
"seconds" (what it took to compile where it was recorded, for the order). A type is the name of a number, or an object
with one key: "array" [number, dimensions, layout, writable], "tuple" [types], or module and name of a named tuple
[types].
"""

from __future__ import annotations

import importlib
from typing import Any

__all__ = ["as_text", "as_type", "find_kernel", "name_of"]


def name_of(function: Any) -> str | None:  # noqa: ANN401 - a dispatcher of numba
    """Module and name under which `find_kernel` finds a kernel; None where it would not."""
    name = f"{function.__module__}.{function.__name__}"
    return name if find_kernel(name) is function else None


def find_kernel(name: str) -> Any:  # noqa: ANN401
    """The kernel of that name, its module imported; None where the module has none."""
    module, _, attribute = name.rpartition(".")
    return getattr(importlib.import_module(module), attribute, None)


def as_text(kind: Any) -> Any:  # noqa: ANN401
    """A type of numba's, in what JSON holds; raises TypeError for one that lists do not know."""
    types = importlib.import_module("numba").types
    if isinstance(kind, types.BaseNamedTuple):
        owner = kind.instance_class
        return {f"{owner.__module__}.{owner.__qualname__}": [as_text(one) for one in kind]}
    if isinstance(kind, types.BaseTuple):
        return {"tuple": [as_text(one) for one in kind]}
    if isinstance(kind, types.Array) and kind.aligned:
        return {"array": [str(kind.dtype), kind.ndim, kind.layout, kind.mutable]}
    if isinstance(kind, types.Number | types.Boolean):
        return str(types.unliteral(kind))
    raise TypeError(f"no text for {kind}")


def as_type(text: Any) -> Any:  # noqa: ANN401
    """The type of a text of `as_text`."""
    types = importlib.import_module("numba").types
    if isinstance(text, str):
        return getattr(types, "boolean" if text == "bool" else text)
    [(name, parts)] = text.items()
    if name == "array":
        number, dimensions, layout, writable = parts
        return types.Array(as_type(number), dimensions, layout, readonly=not writable)
    kinds = [as_type(part) for part in parts]
    if name == "tuple":
        return types.BaseTuple.from_types(kinds)
    return types.BaseTuple.from_types(kinds, find_kernel(name))
