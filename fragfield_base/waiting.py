"""How threads wait for each other: asleep, so that waiting takes no processor time from what they wait for.

Numba's threads are those of OpenMP (GNU's libgomp), which by default spin for milliseconds at the end of every shared
loop before they sleep. Where more threads than free cores run, as in several runs side by side or in ranks with
threads, they then spin on the core that the last thread needs.
"""

from __future__ import annotations

import os

__all__ = ["let_threads_sleep"]


def let_threads_sleep() -> None:
    """Set OMP_WAIT_POLICY to passive for this process and those it starts, unless the user has set how threads wait.

    The library reads it when it is loaded, which `import dolfinx` does as well: what a caller has imported before
    keeps to what it found.
    """
    if not {"OMP_WAIT_POLICY", "GOMP_SPINCOUNT", "KMP_BLOCKTIME"} & set(os.environ):
        os.environ["OMP_WAIT_POLICY"] = "passive"
