"""Detects when numba compiles kernels, so that progress can show it."""

from __future__ import annotations

from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator

__all__ = ["watching_compilation"]

_EVENT = "numba:compile"


@contextmanager
def watching_compilation(changed: Callable[[bool], object]) -> Iterator[None]:
    """Call `changed(True)` when numba begins to compile, and `changed(False)` when it is done, within the context.

    Kernels that come from the cache are not compiled. What a kernel calls is compiled with it: one pair of calls.
    """
    from numba.core import event

    class Watch(event.Listener):
        depth = 0

        def on_start(self, _: Any) -> None:  # noqa: ANN401 - numba's event
            self.depth += 1
            if self.depth == 1:
                changed(True)

        def on_end(self, _: Any) -> None:  # noqa: ANN401
            self.depth -= 1
            if self.depth == 0:
                changed(False)

    watch = Watch()
    event.register(_EVENT, watch)
    try:
        yield
    finally:
        event.unregister(_EVENT, watch)
