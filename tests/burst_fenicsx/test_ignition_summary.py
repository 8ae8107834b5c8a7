"""How a charge was initiated: what its points, their delays, a shock and the end of the burst leave in the record."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("burst_fenicsx.compat")

from burst_fenicsx.mechanics.initiation import Source
from burst_fenicsx.problem import IgnitionPoint
from burst_fenicsx.records.summary import ignitions
from tests.burst_fenicsx.tubes import tube

LENGTH, END = 0.3, 100e-6
D = tube().explosive.detonation_velocity


def _ignitions(points, shock=None, end=END, **changes):
    return ignitions(replace(tube(), ignition=tuple(points), **changes), LENGTH, shock, end)


def test_a_point_initiates_at_once_or_with_its_delay():
    (found,) = _ignitions([IgnitionPoint(0.0)], position=(1.0, 2.0, 3.0))
    assert (found["by"], found["time"], found["station"]) == ("point", 0.0, pytest.approx(0.0, abs=1e-15))
    assert found["place"] == pytest.approx((1.0, 2.0, 3.3))
    (found,) = _ignitions([IgnitionPoint(0.1, (0.01, 0.0), 5e-6)], position=(1.0, 2.0, 3.0))
    assert (found["by"], found["time"], found["station"]) == ("delay", 5e-6, pytest.approx(0.1))
    assert found["place"] == pytest.approx((1.01, 2.0, 3.2))


def test_the_station_of_a_tilted_round_is_along_its_axis():
    (found,) = _ignitions([IgnitionPoint(0.1, (0.01, -0.02))], axis=(1.0, 2.0, -0.5), position=(1.0, 2.0, 3.0))
    assert found["station"] == pytest.approx(0.1)
    away = np.subtract(found["place"], (1.0, 2.0, 3.0))
    assert away @ away == pytest.approx(0.2**2 + 0.01**2 + 0.02**2)


def test_a_point_that_a_front_reaches_first_initiates_nothing():
    """The front from the nose needs 0.2 m / D for the second point."""
    first, late = IgnitionPoint(0.0), 0.2 / D
    assert len(_ignitions([first, IgnitionPoint(0.2, delay=0.99 * late)])) == 2
    assert len(_ignitions([first, IgnitionPoint(0.2, delay=1.01 * late)])) == 1


def test_a_shock_counts_before_the_delay_of_a_point_and_not_behind_its_front():
    shock = Source(8e-6, 17, (0.0, 0.0, 0.1))
    found = _ignitions([IgnitionPoint(0.0, delay=20e-6)], shock)
    assert [(one["by"], one["time"]) for one in found] == [("shock", 8e-6), ("delay", 20e-6)]
    assert found[0]["station"] == pytest.approx(0.2)
    assert [one["by"] for one in _ignitions([IgnitionPoint(0.0, delay=60e-6)], shock)] == ["shock"]
    assert [one["by"] for one in _ignitions([IgnitionPoint(0.0)], Source(50e-6, 17, (0.0, 0.0, 0.1)))] == ["point"]


def test_what_nothing_initiated_by_the_end_was_never_initiated():
    assert _ignitions([]) == []
    assert _ignitions([IgnitionPoint(0.0, delay=END * 1.01)]) == []
