"""Kernels that other kernels call are compiled into them, without wrappers and once for all constants."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from fragfield_base.kernel_cache import compiled_with


@pytest.fixture
def compiled():
    """The decorator of kernels, without a cache."""
    return lambda function, **options: compiled_with(numba, function, **options)


def root_of(x):
    if x < 0.0:
        raise ValueError("no root of", x)
    return np.sqrt(x)


def test_constants_have_one_version(compiled):
    """`lane` is typed as a number: numba gives a function that is called with a constant one version for each."""
    load = compiled(lambda rows, row, lane: rows[4 * row + lane])
    seen = []
    listener = type("Listener", (numba.core.event.Listener,), {
        "on_start": lambda self, event: seen.append(event.data["args"]), "on_end": lambda self, event: None
    })()  # fmt: skip
    total = compiled(lambda rows: load(rows, 0, 1) + load(rows, 2, 3) + load(rows, 1, 0))
    rows = np.arange(12.0)
    with numba.core.event.install_listener("numba:compile", listener):
        assert total(rows) == rows[1] + rows[11] + rows[4]
    assert len([arguments for arguments in seen if len(arguments) == 3]) == 1


def test_what_kernels_call_is_called_from_python_too(compiled):
    square = compiled(lambda x: x * x)
    assert compiled(lambda x: 2.0 * square(x))(3.0) == 18.0
    assert square(3.0) == 9.0


def test_options_hold_within_callers(compiled):
    """A division by zero raises with Python's rules and gives infinity with numpy's."""
    inverse = compiled(lambda x: 1.0 / x, error_model="numpy")
    assert compiled(lambda x: inverse(x) + 1.0, error_model="numpy")(0.0) == np.inf


def test_errors_keep_their_values_through_kernels(compiled):
    root = compiled(root_of)
    deep = compiled(lambda x: root(x - 1.0))
    with pytest.raises(ValueError, match=r"no root of.*-3\.0"):
        compiled(lambda x: deep(x) + root(x))(-2.0)


def test_loops_over_threads_are_part_of_their_callers(compiled):
    def fill(rows):
        for k in numba.prange(rows.size):
            rows[k] = k * k

    inner = compiled(fill, parallel=True)
    total = compiled(lambda rows: (inner(rows), rows.sum())[1])
    rows = np.zeros(1000)
    assert total(rows) == 999 * 1000 * 1999 / 6
    assert np.array_equal(rows, np.arange(1000.0) ** 2)
