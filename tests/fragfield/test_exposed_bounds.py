"""Bounds of exposed sites: exact where exact ones are known, and their coverage."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fragfield.hazard.exposed import share_bound, sum_bound


@pytest.mark.parametrize(("count", "exact"), [(0, 2.9957), (1, 4.7439), (5, 10.5130), (20, 29.0620)])
def test_equal_weights_give_the_poisson_bound(count, exact):
    # upper 95 % limits of a Poisson mean (chi-square quantiles over two)
    assert sum_bound(count, count, 1.0) == pytest.approx(exact, rel=1e-4)
    assert sum_bound(3.0 * count, 9.0 * count, 3.0) == pytest.approx(3.0 * exact, rel=1e-4)


def test_share_bound_is_that_of_clopper_and_pearson():
    assert share_bound(0, 100) == pytest.approx(1.0 - 0.05**0.01, rel=1e-9)
    assert share_bound(100, 100) == 1.0
    bound = share_bound(5, 50)  # by definition: so many or fewer with this probability in 5 % of trials
    below = sum(math.comb(50, k) * bound**k * (1.0 - bound) ** (50 - k) for k in range(6))
    assert below == pytest.approx(0.05, rel=1e-9)


@pytest.mark.parametrize("mean", [0.5, 4.0, 40.0])
def test_coverage_of_unequal_weights(mean):
    generator, trials, held = np.random.default_rng(7), 3000, 0
    for _ in range(trials):
        weights = generator.uniform(0.0, 2.0, generator.poisson(mean))
        held += sum_bound(weights.sum(), (weights**2).sum(), 2.0) >= mean
    assert held / trials >= 0.95 - 1.64 * np.sqrt(0.05 * 0.95 / trials)
