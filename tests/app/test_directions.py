"""The density along a direction, as page 6 shows it of a run's ensemble."""

from __future__ import annotations

import re

import numpy as np
import pytest

from fragfield.app.fields import page_texts
from fragfield.app.pages.result import direction_facts
from fragfield.report.figures.hazard import density_svg
from tests.flight.test_ensemble import ensemble
from tests.fragfield.synthetic_run import run_of


@pytest.mark.parametrize("basis", ["worst_direction", "all_azimuths"])
def test_the_density_of_a_run_by_direction(basis):
    hazard = ensemble(12, basis=basis)
    expected, landing = hazard.expected, np.ones(3, dtype=[("status", int)])
    run = run_of(ensemble=hazard, landed=landing)
    assert density_svg(run_of(ensemble=None), None) == ""
    by_direction = expected.by_direction if basis == "worst_direction" else np.full(36, expected.distance)
    deciding, other = float(expected.direction or 0.0), float(expected.azimuth[np.argmin(by_direction)])
    for azimuth in (deciding, other, other + 360.0):
        rows = dict(direction_facts(hazard, azimuth, page_texts()))
        reach = expected.by_direction[np.argmin(np.abs(expected.azimuth - azimuth % 360.0))]
        assert float(rows["Expected distance"].split()[0].replace(",", "")) == pytest.approx(reach, rel=2e-2)
        assert ("Direction (azimuth)" in rows) == (basis == "worst_direction")
    drawn = [density_svg(run, azimuth) for azimuth in (deciding, other)]
    assert all(len(re.findall("<svg", one)) == 1 for one in drawn)
    assert (drawn[0] != drawn[1]) == (basis == "worst_direction")
