"""The spread of a distance over the inputs: statistical errors taken out, and the error of its quantiles."""

from __future__ import annotations

import numpy as np
import pytest

from fragfield.hazard.recommended import NORMAL_95
from fragfield.studies.uncertainty.spread import spread_of, without_statistical_error


def test_statistical_error_is_taken_out_of_the_spread():
    rng = np.random.default_rng(1)
    exact = rng.normal(100.0, 6.0, 5_000)
    values = exact + rng.normal(0.0, 3.0, 5_000)
    own, resolved = without_statistical_error(values, 9.0)
    assert resolved
    assert own.std() == pytest.approx(6.0, rel=0.03)
    assert own.mean() == pytest.approx(values.mean())
    found = spread_of(values, np.full(5_000, 3.0), rng)
    assert found.high == pytest.approx(100.0 + NORMAL_95 * 6.0, abs=0.45)
    assert found.low == pytest.approx(100.0 - NORMAL_95 * 6.0, abs=0.45)
    assert found.statistical_error == pytest.approx(3.0)


def test_inputs_below_the_statistical_error_stay_too_wide_and_are_marked():
    rng = np.random.default_rng(1)
    values = rng.normal(100.0, 1.0, 500) + rng.normal(0.0, 3.0, 500)
    own, resolved = without_statistical_error(values, 9.0)
    assert not resolved
    np.testing.assert_array_equal(own, values)
    assert not spread_of(values, np.full(500, 3.0), rng).resolved


def test_the_error_of_a_quantile_is_its_spread():
    errors, highs = [], []
    for seed in range(80):
        rng = np.random.default_rng(seed)
        found = spread_of(rng.normal(100.0, 6.0, 200), None, rng)
        errors.append(found.high_standard_error)
        highs.append(found.high)
    assert np.mean(errors) == pytest.approx(np.std(highs, ddof=1), rel=0.25)
