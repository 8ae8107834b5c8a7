"""Random attitudes: the distribution of turns and tilts, and that a realisation's depend on its number alone."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy import stats

from transition.placement.isometry import draw_attitude

TILT = 0.03


def test_tilts_are_normal_about_both_axes_and_independent() -> None:
    tilts = np.array([draw_attitude(7, number, turned=True, tilt=TILT).tilt for number in range(2000)])
    for axis in range(2):
        assert stats.kstest(tilts[:, axis] / TILT, "norm").pvalue > 1e-3
    assert abs(np.corrcoef(tilts.T)[0, 1]) < 4.0 / math.sqrt(len(tilts))
    size = np.hypot(*tilts.T)
    assert abs(np.corrcoef(size[:-1], size[1:])[0, 1]) < 4.0 / math.sqrt(len(tilts))


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
