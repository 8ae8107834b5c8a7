"""Estimators of a study of uncertainty against closed forms: quantiles, variances, Sobol indices, and their errors."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import stats

from fragfield.hazard.recommended import NORMAL_95
from fragfield.studies.uncertainty.distributions import Distribution
from fragfield.studies.uncertainty.expansion import discrete_basis, fit, legendre_basis, terms_of
from fragfield.studies.uncertainty.indices import analyse
from fragfield.studies.uncertainty.plan import latin_hypercube, seed_of, shared_bursts
from fragfield.studies.uncertainty.spread import spread_of, without_statistical_error

A, B = 7.0, 0.1  # of Ishigami and Homma's function
UNIFORM = Distribution("uniform", {"low": 0.0, "high": 1.0})


def _ishigami(u):
    x = np.pi * (2.0 * u - 1.0)
    return np.sin(x[:, 0]) + A * np.sin(x[:, 1]) ** 2 + B * x[:, 2] ** 4 * np.sin(x[:, 0])


def _ishigami_indices():
    """Total and first indices (Ishigami and Homma 1990; Sobol and Levitan 1999)."""
    first = 0.5 * (1.0 + B * np.pi**4 / 5.0) ** 2
    second = A**2 / 8.0
    both = B**2 * np.pi**8 * (1.0 / 18.0 - 1.0 / 50.0)
    total = first + second + both
    return np.array([first + both, second, both]) / total, np.array([first, second, 0.0]) / total


# --- distributions ------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("distribution", "reference"),
    [
        (Distribution("uniform", {"low": 1.59, "high": 2.1}), stats.uniform(1.59, 0.51)),
        (Distribution("normal", {"mean": 1.0, "standard_deviation": 0.05}), stats.norm(1.0, 0.05)),
        (Distribution("normal", {"mean": 1.0, "standard_deviation": 0.05, "low": 0.95, "high": 1.15}),
         stats.truncnorm(-1.0, 3.0, 1.0, 0.05)),
        (Distribution("lognormal", {"median": 2.0, "factor": 1.6}), stats.lognorm(np.log(1.6), scale=2.0)),
        (Distribution("triangular", {"low": 0.91, "mode": 1.0, "high": 1.21}), stats.triang(0.3, 0.91, 0.3)),
        (Distribution("triangular", {"low": 1.0, "mode": 1.0, "high": 1.4}), stats.triang(0.0, 1.0, 0.4)),
    ],
)  # fmt: skip
def test_quantiles_are_those_of_the_distribution(distribution, reference):
    u = np.array([1e-6, 0.01, 0.3, 0.5, 0.77, 0.99, 1.0 - 1e-6])
    np.testing.assert_allclose(distribution.quantile(u), reference.ppf(u), rtol=1e-9)


def test_a_lognormal_factor_holds_68_percent_either_way():
    distribution = Distribution("lognormal", {"median": 1.0, "factor": 1.6})
    np.testing.assert_allclose(distribution.quantile(stats.norm.cdf([-1.0, 1.0])), [1.0 / 1.6, 1.6], rtol=1e-12)


def test_a_discrete_distribution_has_its_weights():
    distribution = Distribution("discrete", {"values": ["sphere", "shell_fragment", 1.0], "weights": [1.0, 2.0, 1.0]})
    drawn = distribution.values((np.arange(1000) + 0.5) / 1000)
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


def test_seeds_of_samples_differ_and_depend_on_nothing_else():
    seeds = [seed_of(1, number) for number in range(2000)]
    assert len(set(seeds)) == 2000
    assert all(0 <= seed < 2**63 for seed in seeds)
    assert seed_of(1, 17) == seeds[17] != seed_of(2, 17)


# --- the expansion --------------------------------------------------------------------------------------------------


def test_bases_are_orthonormal():
    u, weights = np.polynomial.legendre.leggauss(20)
    values = legendre_basis(0.5 * (u + 1.0), 8)
    np.testing.assert_allclose(values.T @ (0.5 * weights[:, None] * values), np.eye(9), atol=1e-12)
    shares = np.array([0.5, 0.2, 0.3])
    steps = discrete_basis(np.arange(3), shares)
    np.testing.assert_allclose(steps.T @ (shares[:, None] * steps), np.eye(3), atol=1e-12)
    np.testing.assert_allclose(steps[:, 0], 1.0, rtol=1e-12)


def test_terms_are_all_products_up_to_the_degree():
    terms = terms_of([3, 3, 3], 3)
    assert len(terms) == 20  # (3 + 3)! / 3! / 3!
    assert len({tuple(row) for row in terms}) == 20
    assert terms.sum(axis=1).max() == 3
    assert not terms[0].any()
    apart = terms_of([1, 1, 2], 2, alone=[0, 1])
    assert [1, 1, 0] not in apart.tolist()
    assert [1, 0, 1] in apart.tolist()


def test_total_effects_of_a_linear_model_with_noise():
    """Y = sum c_i u_i + e: shares c_i^2 / sum c^2, whatever the noise; three standard errors hold it."""
    rng = np.random.default_rng(5)
    c = np.array([4.0, 2.0, 1.0, 0.0])
    points = latin_hypercube(4, 400, 2)
    values = points @ c + rng.normal(0.0, 0.6, 400)
    found = analyse([UNIFORM] * 4, points, values, seed=1)
    totals = np.array([one["total"] for one in found.indices])
    errors = np.array([one["total_standard_error"] for one in found.indices])
    expected = c**2 / (c**2).sum()
    assert (np.abs(totals - expected) < 3.0 * errors + 1e-3).all(), (totals, errors)
    np.testing.assert_allclose(totals, expected, atol=0.03)
    assert found.estimator["degree"] == 1
    assert errors[0] < 0.03
    bars = [one["high"] - one["low"] for one in found.tornado]
    np.testing.assert_allclose(bars, 0.9 * c, atol=0.15)


def test_ishigami_by_the_expansion():
    points = latin_hypercube(3, 1000, 4)
    found = analyse([UNIFORM] * 3, points, _ishigami(points), seed=1)
    total, first = _ishigami_indices()
    np.testing.assert_allclose([one["total"] for one in found.indices], total, atol=0.01)
    np.testing.assert_allclose([one["first"] for one in found.indices], first, atol=0.01)
    assert found.estimator["unexplained"] < 0.02


def test_the_stated_error_is_the_spread_over_repetitions():
    """Over 120 designs with noise the standard deviation of an index is what one of them states, within a quarter."""
    c = np.array([3.0, 2.0, 1.0])
    totals, errors = [], []
    for seed in range(120):
        points = latin_hypercube(3, 60, seed)
        values = points @ c + np.random.default_rng(seed).normal(0.0, 0.8, 60)
        found = analyse([UNIFORM] * 3, points, values, seed=seed)
        totals.append([one["total"] for one in found.indices])
        errors.append([one["total_standard_error"] for one in found.indices])
    spread, stated = np.std(totals, axis=0, ddof=1), np.mean(errors, axis=0)
    np.testing.assert_allclose(stated, spread, rtol=0.3)


def test_a_discrete_input_has_its_share():
    """Y = step + u: variances of the steps and 1/12."""
    kinds = Distribution("discrete", {"values": ["a", "b", "c"], "weights": [0.5, 0.25, 0.25]})
    points = latin_hypercube(2, 500, 3)
    step = np.array([0.0, 1.0, 0.3])[kinds.quantile(points[:, 0]).astype(int)]
    shares = np.array([0.5, 0.25, 0.25])
    own = shares @ np.array([0.0, 1.0, 0.3]) ** 2 - (shares @ np.array([0.0, 1.0, 0.3])) ** 2
    found = analyse([kinds, UNIFORM], points, step + points[:, 1], seed=1)
    assert found.indices[0]["total"] == pytest.approx(own / (own + 1.0 / 12.0), abs=0.02)
    assert found.tornado[0]["high"] - found.tornado[0]["low"] == pytest.approx(1.0, abs=0.01)


def test_few_shared_bursts_are_known_less_well_than_many():
    """Noise that belongs to a burst is no noise of a sample: the error of a burst input's share must say so."""
    c = np.array([2.0, 2.0])
    totals, errors = [], []
    for seed in range(60):
        rng = np.random.default_rng(seed)
        points, burst = shared_bursts(np.array([True, False]), 120, 8, seed)
        values = points @ c + rng.normal(0.0, 0.3, 8)[burst] + rng.normal(0.0, 0.05, 120)
        found = analyse(
            [UNIFORM] * 2, points, values, seed=seed, burst=burst,
            in_burst=[True, False],
        )  # fmt: skip
        totals.append(found.indices[0]["total"])
        errors.append(found.indices[0]["total_standard_error"])
    assert np.mean(totals) == pytest.approx(0.5, abs=0.05)
    assert 0.5 < np.mean(errors) / np.std(totals, ddof=1) < 2.0
    assert np.mean(errors) > 0.03


def test_too_few_samples_are_said():
    points = latin_hypercube(8, 9, 1)
    assert "9 samples are too few for 8 inputs" in analyse([UNIFORM] * 8, points, points.sum(axis=1), seed=1)
    same = np.ones(9)
    assert analyse([UNIFORM] * 8, points, same, seed=1) == "the samples do not differ"


def test_the_degree_is_chosen_by_what_is_left_out():
    points = latin_hypercube(2, 300, 1)
    rng = np.random.default_rng(1)
    for degree in (1, 2, 3):
        values = (points[:, 0] + 0.5 * points[:, 1]) ** degree
        bases = [legendre_basis(points[:, i], 12) for i in range(2)]
        found = fit(bases, values + rng.normal(0.0, 0.01, 300), rng=rng)
        assert found.degree == degree


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
