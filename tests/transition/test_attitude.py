"""Random attitudes: the distribution of every single one, and what realisations drawn together have in common."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from transition.placement.attitude import TOGETHER, draw_attitude

TILT = 0.03
FOURS = 500


@pytest.fixture(scope="module")
def tilts() -> np.ndarray:
    """Tilts (FOURS, 4, 2) of an ensemble."""
    drawn = [draw_attitude(7, number, turned=True, tilt=TILT).tilt for number in range(TOGETHER * FOURS)]
    return np.array(drawn).reshape(FOURS, TOGETHER, 2)


@pytest.mark.parametrize("place", range(TOGETHER))
def test_each_is_distributed_as_one_drawn_alone(tilts, place):
    for axis in range(2):
        assert stats.kstest(tilts[:, place, axis] / TILT, "norm").pvalue > 1e-3
    assert stats.kstest(np.hypot(*tilts[:, place].T) / TILT, "rayleigh").pvalue > 1e-3
    assert abs(np.corrcoef(tilts[:, place].T)[0, 1]) < 4.0 / math.sqrt(FOURS)


def test_four_take_the_quarters_of_the_distribution_a_quarter_of_a_turn_apart(tilts):
    quantile = stats.rayleigh.cdf(np.hypot(tilts[..., 0], tilts[..., 1]) / TILT)
    np.testing.assert_array_equal(
        np.sort((TOGETHER * quantile).astype(int), axis=1), np.tile(range(TOGETHER), (FOURS, 1))
    )
    turn = np.diff(np.arctan2(tilts[..., 1], tilts[..., 0]), axis=1) % (2.0 * math.pi)
    np.testing.assert_allclose(turn, 0.5 * math.pi, atol=1e-9)


def test_the_mean_of_four_varies_far_less_and_fours_are_independent(tilts):
    size = np.hypot(tilts[..., 0], tilts[..., 1])
    means = size.mean(axis=1)
    alone = size.var() / TOGETHER  # of the mean of four independent ones
    assert means.var(ddof=1) < 0.05 * alone
    assert means.mean() == pytest.approx(TILT * math.sqrt(0.5 * math.pi), rel=0.01)
    assert abs(np.corrcoef(means[:-1], means[1:])[0, 1]) < 4.0 / math.sqrt(FOURS)


def test_an_attitude_is_that_of_its_number_alone():
    again = [draw_attitude(7, number, turned=True, tilt=TILT) for number in (6, 3, 6)]
    assert again[0] == again[2]
    assert again[0] != again[1]
    assert draw_attitude(7, 6, turned=True, tilt=2.0 * TILT).tilt == pytest.approx([2.0 * x for x in again[0].tilt])
    assert draw_attitude(8, 6, turned=True, tilt=TILT).tilt != again[0].tilt


def test_the_turn_is_uniform_and_does_not_depend_on_the_tilt():
    turns = np.array([draw_attitude(7, number, turned=True, tilt=0.0).turn for number in range(400)])
    assert stats.kstest(turns / (2.0 * math.pi), "uniform").pvalue > 1e-3
    assert draw_attitude(7, 5, turned=True, tilt=TILT).turn == turns[5]
    still = draw_attitude(7, 5, turned=False, tilt=0.0)
    assert (still.turn, still.tilt, still.tilting) == (None, (0.0, 0.0), None)
