"""Hits by azimuth of a whole ensemble: which bin, whose realisation, and what a wider bin holds."""

from __future__ import annotations

import numpy as np
import pytest

from flight import HITS, InputError
from validation.ring_counts import RingCounts, count_by_azimuth


def hits(azimuth, initial_speed, direction=1):
    rows = np.zeros(len(azimuth), dtype=HITS)
    rows["azimuth"], rows["initial_speed"], rows["direction"] = azimuth, initial_speed, direction
    rows["speed"] = 0.5 * rows["initial_speed"]
    return rows


def test_every_hit_is_in_its_bin_and_realisation():
    rows = hits([0.0, 0.999, 1.0, 359.999, 90.5, 90.2], [100.0, 300.0, 200.0, 50.0, 10.0, 20.0])
    counts = count_by_azimuth(rows, np.array([0, 0, 0, 1, 2, 2]), 4)
    assert counts.hits.shape == (4, 360)
    assert counts.hits.sum() == 6
    assert counts.hits[0, :3].tolist() == [2, 1, 0]
    assert counts.hits[1, 359] == 1
    assert counts.hits[2, 90] == 2
    assert counts.hits[3].sum() == 0
    assert counts.initial_speed[0, 0] == 400.0
    assert counts.largest_initial_speed[0, 0] == 300.0
    assert counts.largest_speed[2, 90] == 10.0
    assert counts.speed.sum() == pytest.approx(340.0)
    assert counts.azimuth[[0, 89, 359]].tolist() == [0.5, 89.5, 359.5]


def test_crossings_inwards_do_not_count():
    rows = hits([10.0, 10.0], [100.0, 900.0], direction=[1, -1])
    counts = count_by_azimuth(rows, np.zeros(2, dtype=np.int64), 1)
    assert counts.hits.sum() == 1
    assert counts.largest_initial_speed.max() == 100.0


def test_wider_bins_hold_the_same_hits():
    generator = np.random.default_rng(2)
    rows = hits(generator.uniform(0.0, 360.0, 5000), generator.uniform(100.0, 2000.0, 5000))
    owner = generator.integers(0, 7, 5000)
    narrow, direct = count_by_azimuth(rows, owner, 7), count_by_azimuth(rows, owner, 7, width=5.0)
    wide = narrow.in_bins_of(5.0)
    assert wide.width == 5.0
    assert np.array_equal(wide.hits, direct.hits)
    assert np.array_equal(wide.largest_initial_speed, direct.largest_initial_speed)
    np.testing.assert_allclose(wide.speed, direct.speed, rtol=1e-12)
    joined = RingCounts.join([narrow, narrow])
    assert joined.realisations == 14
    assert joined.hits.sum() == 10000


@pytest.mark.parametrize("width", [7.0, 0.0, 2.5])
def test_bins_that_do_not_fit_are_refused(width):
    counts = count_by_azimuth(hits([1.0], [1.0]), np.zeros(1, dtype=np.int64), 1)
    with pytest.raises(InputError, match="must divide the circle and hold whole bins of 1 degrees"):
        counts.in_bins_of(width)
