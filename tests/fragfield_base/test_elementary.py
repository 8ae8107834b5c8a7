"""Elementary functions of arrays are the C library's, number by number."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fragfield_base import elementary


@pytest.mark.parametrize(
    ("name", "exact"),
    [("cbrt", math.cbrt), ("cos", math.cos), ("exp", math.exp), ("sin", math.sin)],
)
def test_functions_of_one_array(name, exact):
    values = np.random.default_rng(0).uniform(-3.0, 3.0, (4, 5))
    found = getattr(elementary, name)(values)
    assert found.dtype == np.float64
    assert found.tolist() == [[exact(value) for value in row] for row in values.tolist()]


def test_functions_of_two_are_broadcast():
    base = np.array([[0.5], [2.0]])
    assert elementary.power(base, np.array([1.0, 3.0])).tolist() == [[0.5, 0.125], [2.0, 8.0]]
    assert elementary.arctan2(1.0, np.array([0.0, -0.0])).tolist() == [math.atan2(1.0, 0.0)] * 2


def test_empty_arrays_keep_their_shape():
    assert elementary.sin(np.empty((0, 3))).shape == (0, 3)
