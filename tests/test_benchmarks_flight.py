"""The benchmark of the flight: its clouds, its closed forms and its plain baseline."""

from __future__ import annotations

import numpy as np
import pytest


def test_the_cloud_is_what_the_target_names():
    from benchmarks.flight_plain import burst_cloud

    fragments = burst_cloud(20_000)
    assert 1e-4 <= fragments.mass.min() < 1.1e-4
    assert 0.45 < fragments.mass.max() <= 0.5
    assert 300.0 <= fragments.speed.min() < 310.0
    assert 1990.0 < fragments.speed.max() <= 2000.0
    assert abs((fragments.velocity[:, 2] > 0.0).mean() - 0.5) < 0.02


def test_no_crossing_is_missed_or_invented():
    from benchmarks.flight import crossing_faults

    there, missed, invented = crossing_faults(20_000)
    assert there > 20
    assert (missed, invented) == (0, 0)


def test_the_plain_flight_lands_where_the_library_does():
    from benchmarks.flight_plain import PlainFlight, burst_cloud, plain_seconds
    from flight import fly

    fragments = burst_cloud(3)
    landing = fly(fragments).landing
    plain = PlainFlight(fragments)
    exact = np.array([plain.exact_range(i, float(landing["time"][i])) for i in range(3)])
    assert landing["distance"] == pytest.approx(exact, rel=1e-6)
    rows = plain_seconds(plain, [0, 1], exact[:2], 1e-4)
    assert [row["method"] for row in rows] == ["RK45", "DOP853"]
    assert all(row["error"] <= 1e-4 for row in rows)
