"""The density along a direction, as page 6 shows it of a run's ensemble.h5."""

from __future__ import annotations

import re

import numpy as np
import pytest

from flight.files.ensemble import write_ensemble
from fragfield.app.fields import page_texts
from fragfield.app.pages.result import Directions
from tests.flight.test_ensemble import ensemble

TEXTS = page_texts()


@pytest.mark.parametrize("basis", ["worst_direction", "all_azimuths"])
def test_the_density_of_a_run_by_direction(basis, tmp_path):
    assert Directions.of(tmp_path) is None
    hazard = ensemble(12, basis=basis)
    write_ensemble(hazard, {}, tmp_path)
    known = Directions.of(tmp_path)
    assert known.differ == (basis == "worst_direction")
    limit, expected = hazard.criteria.density, hazard.expected
    assert known.densities(known.deciding) == pytest.approx(expected.density / limit, rel=1e-6)
    least = float(expected.azimuth[np.argmin(expected.by_direction)])
    for azimuth in (known.deciding, least, least + 360.0):
        rows = dict(known.facts(azimuth, TEXTS))
        reach = expected.by_direction[np.argmin(np.abs(expected.azimuth - azimuth % 360.0))]
        assert float(rows["Expected distance"].split()[0].replace(",", "")) == pytest.approx(reach, rel=2e-2)
        assert len(re.findall("<polyline", known.svg(azimuth, TEXTS))) == 2
    assert (known.svg(least, TEXTS) != known.svg(known.deciding, TEXTS)) == known.differ
