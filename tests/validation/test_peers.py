"""The air of another program as the flight takes it; the study itself installs the programs and is not run here."""

from __future__ import annotations

import numpy as np
import pytest

import flight
from validation.peers.study import STEP, TOP, SampledAir, fly


def test_a_flight_in_sampled_air_is_that_in_the_air_sampled() -> None:
    """The standard atmosphere at every metre, straight between: distance and speed to 1e-6."""
    altitude = np.arange(0.0, TOP + 0.5 * STEP, STEP)
    standard = flight.StandardAtmosphere()
    sampled = SampledAir(altitude, (standard.density(altitude), standard.sound_speed(altitude)))
    for drag in (1.0, flight.Drag.named("sphere")):
        ours, theirs = (fly(0.5, 800.0, 60.0, 5.0, 1.0, drag, air) for air in (standard, sampled))
        assert theirs == pytest.approx(ours, rel=1e-6)


def test_denser_air_shows() -> None:
    altitude = np.arange(0.0, TOP + 0.5 * STEP, STEP)
    standard = flight.StandardAtmosphere()
    dense = SampledAir(altitude, (1.001 * standard.density(altitude), standard.sound_speed(altitude)))
    ours, theirs = (fly(0.01, 1000.0, 20.0, 2.0, 0.0, 1.0, air)[0] for air in (standard, dense))
    assert -1e-3 < theirs / ours - 1.0 < -5e-4
