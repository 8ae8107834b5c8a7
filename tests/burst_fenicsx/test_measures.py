"""Quantiles of speed over the mass."""

from __future__ import annotations

import numpy as np
import pytest

pytest.importorskip("dolfinx")

from burst_fenicsx.records.measures import RoundMeasures, speed_quantiles

pytestmark = pytest.mark.dolfinx


def measured(speed, mass):
    nothing = np.zeros(0)
    return RoundMeasures(nothing, nothing, nothing, nothing, nothing, np.asarray(speed), np.asarray(mass))


def test_quantiles_of_speed_are_those_of_the_mass():
    """A mass that grows evenly with the speed: the speed itself, whatever the whole mass and however it is shared."""
    speed = np.linspace(0.0, 1000.0, 2001)[1::2]  # of cells of 1 m/s, at their middles
    for whole in (0.02, 7.0):
        mass = np.full(1000, whole / 1000)
        both = [measured(speed[:300], mass[:300]), measured(speed[300:], mass[300:])]
        for rounds in ([measured(speed, mass)], both, both[::-1]):
            found = speed_quantiles(rounds)
            assert found == {"90": pytest.approx(900.0, abs=0.01), "99": pytest.approx(990.0, abs=0.01)}
    # Three quarters of the mass at 100 m/s, the rest at 500: on the line between the middles of both, 0.375 and 0.875.
    assert speed_quantiles([measured([500.0, 100.0], [0.5, 1.5])])["90"] == 500.0
    assert speed_quantiles([measured([500.0, 100.0], [0.1, 0.9])])["90"] == pytest.approx(100.0 + 400.0 * 0.45 / 0.5)
    assert speed_quantiles([measured([], [])]) == {"90": 0.0, "99": 0.0}
