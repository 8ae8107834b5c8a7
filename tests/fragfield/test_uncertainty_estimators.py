"""Estimators of a study of uncertainty against closed forms: quantiles, variances, shares, and their errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from flight.hazard.density.expected import NORMAL_95
from fragfield.studies.uncertainty.inputs import Distribution
from fragfield.studies.uncertainty.plan import latin_hypercube, shared_bursts
from fragfield.studies.uncertainty.statistics import analyse, spread_of, without_statistical_error

UNIFORM = Distribution("uniform", low=0.0, high=1.0)


def _uniform(number):
    return [(f"input {i}", UNIFORM) for i in range(number)]


# --- distributions ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("kind", "values", "reference"),
    [
        ("uniform", {"low": 1.59, "high": 2.1}, stats.uniform(1.59, 0.51)),
        ("normal", {"mean": 1.0, "standard_deviation": 0.05}, stats.norm(1.0, 0.05)),
        ("normal", {"mean": 1.0, "standard_deviation": 0.05, "low": 0.95, "high": 1.15},
         stats.truncnorm(-1.0, 3.0, 1.0, 0.05)),
        ("triangular", {"low": 0.91, "mode": 1.0, "high": 1.21}, stats.triang(0.3, 0.91, 0.3)),
    ],
)  # fmt: skip
def test_quantiles_are_those_of_the_distribution(kind, values, reference):
    u = np.array([1e-6, 0.01, 0.3, 0.5, 0.77, 0.99, 1.0 - 1e-6])
    np.testing.assert_allclose(Distribution(kind, **values).quantile(u), reference.ppf(u), rtol=1e-9)


def test_a_lognormal_factor_holds_68_percent_either_way():
    distribution = Distribution("lognormal", median=1.0, factor=1.6)
    np.testing.assert_allclose(distribution.quantile(stats.norm.cdf([-1.0, 1.0])), [1.0 / 1.6, 1.6], rtol=1e-12)


def test_a_discrete_distribution_has_its_weights():
    distribution = Distribution("discrete", values=["sphere", "shell_fragment", 1.0], weights=[1.0, 2.0, 1.0])
    drawn = distribution.drawn((np.arange(1000) + 0.5) / 1000)
    assert [drawn.count(value) for value in ("sphere", "shell_fragment", 1.0)] == [250, 500, 250]


# --- design ---------------------------------------------------------------------------------------------------------


def test_a_latin_hypercube_has_one_point_in_every_stratum_and_its_seed():
    points = latin_hypercube(3, 50, 7)
    for column in points.T:
        assert sorted((column * 50).astype(int)) == list(range(50))
    np.testing.assert_array_equal(points, latin_hypercube(3, 50, 7))
    assert not np.array_equal(points, latin_hypercube(3, 50, 8))


def test_shared_bursts_are_dealt_out_evenly():
    points, burst = shared_bursts(np.array([True, False, True]), 40, 8, 3)
    assert np.bincount(burst).tolist() == [5] * 8
    for one in range(8):
        assert len(np.unique(points[burst == one][:, [0, 2]], axis=0)) == 1
    assert len(np.unique(points[:, 1])) == 40


# --- shares -----------------------------------------------------------------------------------------------------------


def test_shares_of_a_linear_model_with_noise():
    """Y = sum c_i u_i + e: shares c_i^2 / sum c^2, whatever the noise; three standard errors hold it."""
    rng = np.random.default_rng(5)
    c = np.array([4.0, 2.0, 1.0, 0.0])
    points = latin_hypercube(4, 400, 2)
    values = points @ c + rng.normal(0.0, 0.6, 400)
    found = analyse(_uniform(4), points, values, seed=1)
    shares = np.array([one.share for one in found.shares])
    errors = np.array([one.share_standard_error for one in found.shares])
    expected = c**2 / (c**2).sum()
    assert (np.abs(shares - expected) < 3.0 * errors + 0.01).all(), (shares, errors)
    np.testing.assert_allclose(shares, expected, atol=0.03)
    assert shares.sum() == pytest.approx(1.0)
    assert errors[0] < 0.03
    bars = [one.high - one.low for one in found.tornado]
    np.testing.assert_allclose(bars, 0.9 * c, atol=0.15)


def test_shares_depend_on_ranks_alone():
    """A result and a steep monotone function of it have the same shares, and what is not monotone is not explained."""
    points = latin_hypercube(2, 200, 4)
    values = points @ [2.0, 1.0]
    found, steep = (analyse(_uniform(2), points, one, seed=1) for one in (values, np.exp(9.0 * values)))
    assert found.shares == steep.shares
    assert found.estimator.explained > 0.98
    bowl = analyse(_uniform(2), points, (points[:, 0] - 0.5) ** 2, seed=1)
    assert bowl.estimator.explained < 0.05


def test_the_stated_error_is_the_spread_over_repetitions():
    """Over 120 designs with noise the standard deviation of a share is what one of them states, within 30 %."""
    c = np.array([3.0, 2.0, 1.0])
    shares, errors = [], []
    for seed in range(120):
        points = latin_hypercube(3, 60, seed)
        values = points @ c + np.random.default_rng(seed).normal(0.0, 0.8, 60)
        found = analyse(_uniform(3), points, values, seed=seed)
        shares.append([one.share for one in found.shares])
        errors.append([one.share_standard_error for one in found.shares])
    spread, stated = np.std(shares, axis=0, ddof=1), np.mean(errors, axis=0)
    np.testing.assert_allclose(stated, spread, rtol=0.3)


def test_a_discrete_input_has_its_share():
    """Y = step + u: variances of the steps and 1/12; the order of the steps is of no account."""
    kinds = Distribution("discrete", values=["a", "b", "c"], weights=[0.5, 0.25, 0.25])
    points = latin_hypercube(2, 500, 3)
    step = np.array([0.0, 1.0, 0.3])[kinds.quantile(points[:, 0]).astype(int)]
    shares = np.array([0.5, 0.25, 0.25])
    own = shares @ np.array([0.0, 1.0, 0.3]) ** 2 - (shares @ np.array([0.0, 1.0, 0.3])) ** 2
    found = analyse([("step", kinds), *_uniform(1)], points, step + points[:, 1], seed=1)
    assert found.shares[0].share == pytest.approx(own / (own + 1.0 / 12.0), abs=0.03)
    assert found.tornado[0].high - found.tornado[0].low == pytest.approx(1.0, abs=0.01)


def test_few_shared_bursts_are_known_less_well_than_many():
    """Noise that belongs to a burst is no noise of a sample: the error of a burst input's share must say so."""
    c = np.array([2.0, 2.0])
    shares, errors = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        points, burst = shared_bursts(np.array([True, False]), 120, 8, seed)
        values = points @ c + rng.normal(0.0, 0.3, 8)[burst] + rng.normal(0.0, 0.05, 120)
        found = analyse(_uniform(2), points, values, seed=seed, burst=burst)
        shares.append(found.shares[0].share)
        errors.append(found.shares[0].share_standard_error)
    assert np.mean(shares) == pytest.approx(0.5, abs=0.05)
    assert 0.5 < np.mean(errors) / np.std(shares, ddof=1) < 2.0
    assert np.mean(errors) > 0.03


def test_too_few_samples_are_said():
    points = latin_hypercube(8, 9, 1)
    inputs = _uniform(8)
    assert "9 samples are too few for 8 inputs" in analyse(inputs, points, points.sum(axis=1), seed=1).estimator.reason
    same = np.ones(9)
    assert analyse(inputs, points, same, seed=1).estimator.reason == "the samples do not differ"


# --- The spread of a distance over the inputs: statistical errors taken out, and the error of its quantiles


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
