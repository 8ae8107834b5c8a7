"""Loops shared by numba's threads: every item once, whatever the number of threads; kernels that have them are kept."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from burst_fenicsx.kernels.lanes import kernel
from burst_fenicsx.kernels.threads import on_threads


@kernel
def _count_some(first, last, times, numbers, parts):
    for k in range(first, last):
        numbers[k] += times[0] * k
    parts[numba.get_thread_id()] += last - first


@kernel
def _count(times, numbers, parts):
    on_threads(numbers.size, _count_some, (times, numbers, parts))


@pytest.mark.filterwarnings("error")  # such as that a kernel cannot be kept
@pytest.mark.parametrize("size", [0, 1, 2, 1001])
@pytest.mark.parametrize("threads", [1, 2])
def test_each_item_is_worked_on_once(size, threads):
    """The threads' parts differ by one item at most; arguments of any kind reach them."""
    before = numba.get_num_threads()
    threads = min(threads, before)
    numba.set_num_threads(threads)
    try:
        numbers, parts = np.zeros(size, dtype=np.int64), np.zeros(before, dtype=np.int64)
        _count((3, None), numbers, parts)
        np.testing.assert_array_equal(numbers, 3 * np.arange(size))
        assert sorted(parts[parts > 0].tolist()) == [n for n in (size // threads, -(-size // threads))[-threads:] if n]
    finally:
        numba.set_num_threads(before)
