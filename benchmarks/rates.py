"""What the machine can do at most: memory band width and arithmetic, measured by loops that do nothing else."""

from __future__ import annotations

import numba
import numpy as np

from benchmarks.timing import best_of, on_threads
from burst_fenicsx.kernels.lanes import widest_vectors

__all__ = ["arithmetic", "band_width"]

_ELEMENTS = 1 << 25  # 256 MiB an array: beyond every cache but that of a machine shared with others
_REPEATS = 4
_PASSES, _CHAINS, _LENGTH, _ROUNDS = 300, 8, 1024, 8


@numba.njit(parallel=True)
def _triad(first: np.ndarray, second: np.ndarray, factor: float, result: np.ndarray) -> None:
    for i in numba.prange(result.size):
        result[i] = first[i] + factor * second[i]


def band_width(threads: int) -> float:
    """Bytes per second that move between memory and `threads` cores in McCalpin's triad (STREAM).

    Four words an element: two are read, one is written, and its line is read before, which STREAM does not count.
    """
    first, second, result = (np.full(_ELEMENTS, value) for value in (1.0, 2.0, 0.0))
    with on_threads(threads):
        seconds = best_of(_REPEATS, {"triad": (1, lambda: _triad(first, second, 3.0, result))})["triad"]
    return 4 * first.nbytes / seconds


def _chains(values: np.ndarray, passes: int, factor: float, shift: float) -> None:
    """Eight independent chains of multiplications and additions an element, in registers."""
    widest_vectors()
    for _ in range(passes):
        for i in range(values.size):
            a = values[i]
            b, c, d, e = a + 1.0, a + 2.0, a + 3.0, a + 4.0
            f, g, h = a + 5.0, a + 6.0, a + 7.0
            for _ in range(_ROUNDS):
                a = a * factor + shift
                b = b * factor + shift
                c = c * factor + shift
                d = d * factor + shift
                e = e * factor + shift
                f = f * factor + shift
                g = g * factor + shift
                h = h * factor + shift
            values[i] = ((a + b) + (c + d)) + ((e + f) + (g + h))


def arithmetic(*, fused: bool) -> float:
    """Multiplications and additions per second of one core; `fused` makes one instruction of each pair."""
    loop = numba.njit(fastmath={"contract", "nsz"} if fused else {"nsz"})(_chains)
    values = np.linspace(0.0, 1.0, _LENGTH)
    seconds = best_of(_REPEATS, {"chains": (1, lambda: loop(values, _PASSES, 0.1, 0.01))})["chains"]
    per_element = 2 * _CHAINS * _ROUNDS + 2 * (_CHAINS - 1)
    return per_element * _LENGTH * _PASSES / seconds
