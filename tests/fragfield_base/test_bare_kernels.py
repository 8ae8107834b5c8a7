"""Kernels that other kernels call are compiled for them without wrappers, once for all constants."""

from __future__ import annotations

import numba
import numpy as np
import pytest

from fragfield_base import kernel_cache


@pytest.fixture
def compiled(monkeypatch):
    """The decorator of kernels, without a cache."""
    monkeypatch.setattr(kernel_cache, "cache_root", lambda: None)
    return lambda function, **options: kernel_cache.compiled_with(numba, function, "none", **options)


def test_constants_have_one_version_and_no_wrapper(compiled):
    load = compiled(lambda rows, row, lane: rows[4 * row + lane])
    total = compiled(lambda rows: load(rows, 0, 1) + load(rows, 2, 3) + load(rows, 1, 0))
    rows = np.arange(12.0)
    assert total(rows) == rows[1] + rows[11] + rows[4]
    assert not load.signatures, "nothing was compiled for Python"
    [version] = load.fragfield_bare.overloads.values()
    assert not any("cpython" in name for name in version.library.get_llvm_str().split() if name.startswith("@"))


def test_what_kernels_call_is_called_from_python_too(compiled):
    square = compiled(lambda x: x * x)
    twice = compiled(lambda x: 2.0 * square(x))
    assert twice(3.0) == 18.0
    assert square(3.0) == 9.0
    assert len(square.signatures) == len(square.fragfield_bare.signatures) == 1


def test_options_hold_for_the_bare_version(compiled):
    """A division by zero raises with Python's rules and gives infinity with numpy's."""
    inverse = compiled(lambda x: 1.0 / x, error_model="numpy")
    assert compiled(lambda x: inverse(x) + 1.0, error_model="numpy")(0.0) == np.inf
