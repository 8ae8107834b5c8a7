"""Times of things that are compared: taken in turns, the best of some repeats, on a given number of threads."""

from __future__ import annotations

import time
from contextlib import contextmanager
from typing import TYPE_CHECKING

import numba

if TYPE_CHECKING:
    from collections.abc import Callable, Iterator, Mapping

__all__ = ["all_threads", "best_of", "on_threads"]


def all_threads() -> int:
    """Threads that numba may use here."""
    return int(numba.config.NUMBA_NUM_THREADS)


@contextmanager
def on_threads(number: int) -> Iterator[None]:
    """Run numba's parallel loops on `number` threads."""
    before = numba.get_num_threads()
    numba.set_num_threads(number)
    try:
        yield
    finally:
        numba.set_num_threads(before)


def best_of(repeats: int, actions: Mapping[str, tuple[int, Callable[[], object]]]) -> dict[str, float]:
    """Seconds of one call of each action.

    Parameters
    ----------
    repeats : how often each is timed; what else the machine does disturbs the best one little.
    actions : by name, how many calls are timed together, and what is called. All take turns, so that a slower spell of
        the machine meets them alike. Each is called once before, untimed.
    """
    best = dict.fromkeys(actions, float("inf"))
    for _, action in actions.values():
        action()
    for _ in range(repeats):
        for name, (calls, action) in actions.items():
            began = time.perf_counter()
            for _ in range(calls):
                action()
            best[name] = min(best[name], (time.perf_counter() - began) / calls)
    return best
